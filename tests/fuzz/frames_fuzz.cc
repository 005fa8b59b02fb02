// SPDX-License-Identifier: Apache-2.0
// The bytes are a program: images, camera infos, transforms and steps of the clock, in any order and with any content.
// The frame assembler takes them as they would come from the bus; frames that it gives are sound, and what it keeps
// stays small.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <span>
#include <string>

#include "prescene/core/check.h"
#include "prescene/service/tracking/frame_assembler.h"

using namespace prescene;  // NOLINT(google-build-using-namespace)

namespace {

/// Takes values off the bytes; zeros when they are used up.
class Bytes {
 public:
  explicit Bytes(std::span<const std::uint8_t> bytes) : rest_(bytes) {}
  bool empty() const { return rest_.empty(); }

  template <class T>
  T raw() {
    T value{};
    const std::size_t count = std::min(sizeof value, rest_.size());
    if (count > 0) std::memcpy(&value, rest_.data(), count);
    rest_ = rest_.subspan(count);
    return value;
  }
  std::uint8_t byte() { return raw<std::uint8_t>(); }
  std::span<const std::uint8_t> take(std::size_t count) {
    const auto taken = rest_.first(std::min(count, rest_.size()));
    rest_ = rest_.subspan(taken.size());
    return taken;
  }
  /// Mostly a name that fits, sometimes anything.
  std::string name() {
    static constexpr std::array<const char*, 6> kNames = {"world", "camera", "/camera", "hand", "arm", ""};
    const std::uint8_t which = byte();
    if (which < 240) return kNames[which % kNames.size()];
    const auto any = take(which - 240U);
    return {any.begin(), any.end()};
  }
  double number() {
    static constexpr std::array<double, 8> kNumbers = {0.0, 1.0, -1.0, 0.5, 20.0, 1e300, NAN, INFINITY};
    const std::uint8_t which = byte();
    return which < 200 ? kNumbers[which % kNumbers.size()] : raw<double>();
  }
  interfaces::RosTime time() {
    const std::uint8_t which = byte();
    if (which < 250) return {1000 + which / 50, static_cast<std::uint32_t>(which % 50) * 20'000'000U};
    const auto seconds = raw<std::int32_t>();
    return {seconds, raw<std::uint32_t>()};
  }
  std::uint32_t side() {
    const std::uint8_t which = byte();
    return which < 250 ? which % 9U : raw<std::uint32_t>();
  }

 private:
  std::span<const std::uint8_t> rest_;
};

interfaces::RosImage image(Bytes& bytes) {
  static constexpr std::array<const char*, 7> kEncodings = {"16UC1", "32FC1", "rgb8", "mono16", "bgra8", "8UC1", "x"};
  static constexpr std::array<std::uint32_t, 7> kPixelBytes = {2, 4, 3, 2, 4, 1, 1};
  interfaces::RosImage image;
  image.header.stamp = bytes.time();
  image.header.frame_id = bytes.name();
  const std::size_t encoding = bytes.byte() % kEncodings.size();
  image.encoding = kEncodings[encoding];
  image.width = bytes.side();
  image.height = bytes.side();
  image.is_bigendian = static_cast<std::uint8_t>(bytes.byte() % 3);
  const std::uint8_t more = bytes.byte();
  image.step = more < 250 ? image.width * kPixelBytes[encoding] + more % 3 : bytes.raw<std::uint32_t>();
  // As much data as a sound image of this size would have, in a pattern; or what comes.
  const std::uint64_t sound = std::uint64_t{image.step} * image.height;
  if (sound <= 4096 && more % 7 != 0) {
    const auto pattern = bytes.take(4);
    for (std::uint64_t i = 0; i < sound; ++i) {
      image.data.push_back(pattern.empty() ? std::uint8_t{7} : pattern[static_cast<std::size_t>(i) % pattern.size()]);
    }
  } else {
    const auto any = bytes.take(bytes.byte());
    image.data.assign(any.begin(), any.end());
  }
  return image;
}

interfaces::RosCameraInfo camera_info(Bytes& bytes) {
  static constexpr std::array<const char*, 4> kModels = {"plumb_bob", "equidistant", "", "rational_polynomial"};
  interfaces::RosCameraInfo info;
  info.width = bytes.side();
  info.height = bytes.side();
  info.distortion_model = kModels[bytes.byte() % kModels.size()];
  for (int i = bytes.byte() % 10; i > 0; --i) info.d.push_back(bytes.number());
  if (bytes.byte() < 200) {
    info.k = {10.0, 0.0, 2.0, 0.0, 10.0, 2.0, 0.0, 0.0, 1.0};
    info.p = {10.0, 0.0, 2.0, 0.0, 0.0, 10.0, 2.0, 0.0, 0.0, 0.0, 1.0, 0.0};
  } else {
    for (double& k : info.k) k = bytes.number();
    for (double& p : info.p) p = bytes.number();
  }
  info.binning_x = bytes.byte() % 4;
  info.binning_y = bytes.byte() % 4;
  return info;
}

interfaces::RosTfMessage transforms(Bytes& bytes) {
  interfaces::RosTfMessage message;
  for (int i = bytes.byte() % 8; i > 0; --i) {
    interfaces::RosTransformStamped transform;
    transform.header.stamp = bytes.time();
    transform.header.frame_id = bytes.name();
    transform.child_frame_id = bytes.name();
    transform.transform.translation = {bytes.number(), bytes.number(), bytes.number()};
    const bool sound = bytes.byte() < 200;
    transform.transform.rotation.w = sound ? 1.0 : bytes.number();
    if (!sound) transform.transform.rotation.x = bytes.number();
    message.transforms.push_back(std::move(transform));
  }
  return message;
}

void take_all(service::FrameAssembler& assembler, core::TimeNs now_ns) {
  while (const auto frame = assembler.take(now_ns)) {
    const belief::Observation& observation = frame->observation;
    PRESCENE_CHECK(observation.frame.depth != nullptr);
    PRESCENE_CHECK(observation.frame.depth->width() == observation.frame.camera.width);
    PRESCENE_CHECK(observation.frame.depth->height() == observation.frame.camera.height);
    PRESCENE_CHECK(!observation.frame.color || observation.frame.color->width() == observation.frame.camera.width);
    PRESCENE_CHECK(geometry::validate(observation.frame.camera).ok());
    PRESCENE_CHECK(observation.X_WC.is_finite());
    for (const auto& [name, X_WG] : observation.robot) PRESCENE_CHECK(X_WG.is_finite());
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Bytes bytes({data, size});
  const std::uint8_t kind = bytes.byte();
  service::AssemblerSettings settings;
  settings.use_color = (kind & 1U) != 0;
  settings.rectified = (kind & 2U) != 0;
  settings.mono16_is_depth = (kind & 4U) != 0;
  if ((kind & 8U) != 0) settings.X_WC = geometry::Pose::identity();
  if ((kind & 16U) != 0) settings.camera_frame = "camera";
  service::FrameAssembler assembler(settings, {"hand"});
  core::TimeNs now_ns = 1'000'000'000'000;
  std::uint64_t skipped = 0;
  for (service::MessageIndex index = 0; !bytes.empty(); ++index) {
    core::Status taken;
    switch (bytes.byte() % 7) {
      case 0:
      case 1:
        taken = assembler.add_depth(image(bytes), index, now_ns);
        break;
      case 2:
        taken = assembler.add_color(image(bytes), index, now_ns);
        break;
      case 3:
        taken = assembler.add_camera_info(camera_info(bytes), index);
        break;
      case 4:
        taken = assembler.add_tf(transforms(bytes), index, bytes.byte() % 2 == 0);
        break;
      case 5:
        now_ns += std::int64_t{1'000'000} * bytes.raw<std::int16_t>();
        take_all(assembler, now_ns);
        break;
      default:
        const auto reasons = assembler.take_skipped();
        PRESCENE_CHECK(reasons.size() <= 1000);
        skipped += reasons.size();
        for (const service::SkippedFrame& frame : reasons) PRESCENE_CHECK(!frame.reason.empty());
        break;
    }
    PRESCENE_CHECK(taken.ok() || !taken.message().empty());
  }
  // What waits goes when its time is over.
  int rounds = 0;
  for (auto deadline = assembler.next_deadline(); deadline; deadline = assembler.next_deadline()) {
    now_ns = std::max(now_ns, *deadline);
    take_all(assembler, now_ns);
    PRESCENE_CHECK_MSG(++rounds <= 100, "a frame waits for ever");
  }
  PRESCENE_CHECK(assembler.skipped_count() >= skipped);
  return 0;
}
