// SPDX-License-Identifier: Apache-2.0
// What a page does: opens the WebSocket, reads documents and pictures, asks.
#pragma once

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>

#include "prescene/belief/json.h"
#include "prescene/service/view/view_content.h"
#include "tests/interfaces/web/web_client.h"
#include "tests/service/query_worker_fixture.h"

namespace prescene::tests {

class PageClient {
 public:
  explicit PageClient(int port) : socket_(port) {
    socket_.send(interfaces::handshake("prescene.view.v1"));
    EXPECT_TRUE(socket_.read_head().starts_with("HTTP/1.1 101 "));
  }
  void say(const nlohmann::ordered_json& request) {
    socket_.send(interfaces::client_frame(1, belief::json_text(request)));
  }
  void say_text(const std::string& text) { socket_.send(interfaces::client_frame(1, text)); }
  /// The next document with this "op"; what comes before it is passed over, of pictures the last is kept.
  nlohmann::ordered_json next(const std::string& op) {
    for (auto message = socket_.read_message(); message; message = socket_.read_message()) {
      if (message->opcode == 2) {
        picture = message->payload;
        continue;
      }
      auto document = nlohmann::ordered_json::parse(message->payload, nullptr, false);
      if (document.value("op", "") == op) return document;
    }
    ADD_FAILURE() << "no " << op << " came";
    return {};
  }
  std::string picture;

 private:
  interfaces::WebClientSocket socket_;
};

/// The box's belief after so many steps, with a frame of 40 x 30 pixels.
inline service::ShownStep shown_step(std::uint64_t step) {
  const auto belief = belief_of(kBoxScene);
  belief->step = step;
  belief->stamp_ns = 1'000'000'000 + static_cast<core::TimeNs>(step) * 100'000'000;
  belief->objects[0].particles[0].X_WO.translation.x() = 0.01 * static_cast<double>(step);
  service::ShownStep shown{belief, {}, 0.01, {}};
  shown.observation.frame.camera = {40, 30, 40.0, 40.0, 19.5, 14.5};
  shown.observation.frame.depth = std::make_shared<const geometry::DepthImage>(40, 30, 1.0F);
  shown.observation.frame.color =
      std::make_shared<const geometry::ColorImage>(40, 30, geometry::Rgb{200, static_cast<std::uint8_t>(step), 0});
  return shown;
}

}  // namespace prescene::tests
