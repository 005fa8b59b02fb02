// SPDX-License-Identifier: Apache-2.0
#include "benchmarks/interfaces_processes.h"

#include <dds/dds.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <new>
#include <sstream>
#include <utility>

#include "prescene/core/check.h"
#include "prescene/core/clock.h"
#include "prescene/service/live/bus_recorder.h"
#include "prescene/service/live/live_service.h"
#include "prescene/service/load_scene.h"
#include "prescene/service/view/live_view.h"

// Compiled into interfaces/dds from its IDL, which gives it its name.
extern "C" const dds_topic_descriptor_t sensor_msgs_msg_dds__Image__desc;  // NOLINT(readability-identifier-naming)

namespace prescene::benchmarks {
namespace {

core::Cancellation* child_cancellation = nullptr;

core::LogSink log_sink(const char* name) {
  return [name](core::LogLevel level, const std::string& text) {
    if (level >= core::LogLevel::kWarning) std::fprintf(stderr, "%s: %s\n", name, text.c_str());
  };
}

interfaces::DdsOptions on_domain(int domain, const char* name) {
  interfaces::DdsOptions options;
  options.domain = domain;
  options.node_name = name;
  return options;
}

}  // namespace

template <class T>
SharedFigures<T>::SharedFigures(std::size_t most) : most_(most) {
  void* memory =
      mmap(nullptr, sizeof(Block) + most * sizeof(T), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  PRESCENE_CHECK(memory != MAP_FAILED);
  block_ = new (memory) Block{};
}

template <class T>
SharedFigures<T>::~SharedFigures() {
  munmap(block_, sizeof(Block) + most_ * sizeof(T));
}

template class SharedFigures<FrameTimes>;
template class SharedFigures<double>;

Child Child::start(const std::function<void(const core::Cancellation&)>& work) {
  const pid_t id = fork();
  PRESCENE_CHECK(id >= 0);
  if (id > 0) return Child(id);
  static core::Cancellation cancellation;
  child_cancellation = &cancellation;
  std::signal(SIGTERM, [](int) { child_cancellation->request(); });
  work(cancellation);
  std::_Exit(0);
}

void Child::wait() {
  if (id_ > 0) waitpid(id_, nullptr, 0);
  id_ = -1;
}

void Child::stop(bool by_kill) {
  if (id_ > 0) kill(id_, by_kill ? SIGKILL : SIGTERM);
  wait();
}

double Child::processor_seconds() const {
  std::ifstream file("/proc/" + std::to_string(id_) + "/stat");
  std::string text((std::istreambuf_iterator<char>(file)), {});
  std::istringstream rest(text.substr(std::min(text.size(), text.rfind(')') + 2)));
  std::string word;
  double user = 0.0, system = 0.0;
  for (int i = 0; i < 11; ++i) rest >> word;  // up to the fields before utime
  rest >> user >> system;
  return (user + system) / static_cast<double>(sysconf(_SC_CLK_TCK));
}

void run_service(const std::string& scene_yaml, int domain, SharedFigures<FrameTimes>& frames,
                 const core::Cancellation& cancellation, int view_port) {
  core::ThreadPool pool;
  service::Backends backends(pool);
  const auto scene = service::load_scene_text(scene_yaml, "bench.yaml", {});
  PRESCENE_CHECK_MSG(scene.ok(), scene.status().message());
  service::LiveSettings settings;
  settings.dds = on_domain(domain, "bench_service");
  std::unique_ptr<service::LiveView> view;
  if (view_port != 0) {
    service::ViewOptions view_options;
    view_options.port = view_port;
    auto made = service::LiveView::create(*scene, view_options, log_sink("view"));
    PRESCENE_CHECK_MSG(made.ok(), made.status().message());
    view = *std::move(made);
  }
  settings.on_step = [&frames, &view](const service::TrackerStep& step,
                                      const std::shared_ptr<const belief::Belief>& belief) {
    if (view) view->show({belief, step.observation, step.record.seconds, step.record.degraded});
    const double published = core::seconds_of(core::wall_now_ns() - step.record.stamp_ns);
    frames.add({published - step.record.seconds, published, step.record.seconds});
  };
  const auto live = service::LiveService::create(*scene, settings, 1, backends, nullptr, log_sink("service"));
  PRESCENE_CHECK_MSG(live.ok(), live.status().message());
  const core::Status ran = (*live)->run(cancellation);
  if (!ran.ok()) std::fprintf(stderr, "service: %s\n", ran.message().c_str());
}

void run_pages(int view_port, int count, const SharedFigures<double>& phases, SharedFigures<double>& taken,
               const core::Cancellation& cancellation) {
  const std::string handshake =
      "GET / HTTP/1.1\r\nHost: 127.0.0.1:" + std::to_string(view_port) +
      "\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n"
      "Sec-WebSocket-Version: 13\r\nSec-WebSocket-Protocol: prescene.view.v1\r\n\r\n";
  const auto connected = [&]() -> int {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<std::uint16_t>(view_port));
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    const int page = socket(AF_INET, SOCK_STREAM, 0);
    const bool is_open = page >= 0 && connect(page, reinterpret_cast<sockaddr*>(&address), sizeof address) == 0 &&
                         send(page, handshake.data(), handshake.size(), MSG_NOSIGNAL) > 0;
    PRESCENE_CHECK_MSG(is_open, "the live view does not take a page");
    return page;
  };
  std::vector<pollfd> pages;
  double bytes = 0.0;
  std::vector<char> buffer(std::size_t{1} << 16);
  while (!cancellation.requested()) {
    const bool wanted = phases.all().size() % 2 == 1;
    if (wanted && pages.empty()) {
      for (int i = 0; i < count; ++i) pages.push_back({connected(), static_cast<short>(i == 0 ? 0 : POLLIN), 0});
    } else if (!wanted && !pages.empty()) {
      for (const pollfd& page : pages) close(page.fd);
      pages.clear();
      taken.add(std::exchange(bytes, 0.0));
    }
    poll(pages.data(), pages.size(), 20);
    for (pollfd& page : pages) {
      if ((page.revents & POLLIN) == 0) continue;
      const ssize_t got = recv(page.fd, buffer.data(), buffer.size(), 0);
      PRESCENE_CHECK_MSG(got > 0, "the live view ended a page that reads");
      bytes += static_cast<double>(got);
    }
  }
}

void run_recorder(int domain, const std::filesystem::path& path, const core::Cancellation& cancellation) {
  const auto recording = service::RollingRecording::create(path, {}, {.part = {}, .safety = {}});
  PRESCENE_CHECK_MSG(recording.ok(), recording.status().message());
  const auto done = service::record_topics(on_domain(domain, "bench_recorder"), {service::CameraInput()}, cancellation,
                                           log_sink("recorder"), **recording);
  if (!done) std::fprintf(stderr, "recorder: %s\n", done.status().message().c_str());
}

void run_bare_reader(int domain, SharedFigures<double>& delays, const core::Cancellation& cancellation) {
  // The buffer that our nodes ask for, too.
  const char* const config = "<Domain><Internal><SocketReceiveBufferSize max=\"8MiB\"/></Internal></Domain>";
  dds_create_domain(static_cast<dds_domainid_t>(domain), config);
  const dds_entity_t participant = dds_create_participant(static_cast<dds_domainid_t>(domain), nullptr, nullptr);
  const std::string name = "rt" + service::InputTopics().depth;
  const dds_entity_t topic =
      dds_create_topic(participant, &sensor_msgs_msg_dds__Image__desc, name.c_str(), nullptr, nullptr);
  dds_qos_t* qos = dds_create_qos();
  dds_qset_reliability(qos, DDS_RELIABILITY_BEST_EFFORT, 0);
  dds_qset_history(qos, DDS_HISTORY_KEEP_LAST, 5);
  const dds_entity_t reader = dds_create_reader(participant, topic, qos, nullptr);
  dds_delete_qos(qos);
  PRESCENE_CHECK(participant > 0 && topic > 0 && reader > 0);
  const dds_entity_t waits = dds_create_waitset(participant);
  dds_set_status_mask(reader, DDS_DATA_AVAILABLE_STATUS);
  dds_waitset_attach(waits, reader, 0);
  while (!cancellation.requested()) {
    dds_waitset_wait(waits, nullptr, 0, DDS_MSECS(50));
    std::array<void*, 8> samples{};
    std::array<dds_sample_info_t, 8> infos{};
    const int count = dds_take(reader, samples.data(), infos.data(), samples.size(), samples.size());
    const core::TimeNs now_ns = core::wall_now_ns();
    for (std::size_t i = 0; static_cast<int>(i) < count; ++i)
      if (infos[i].valid_data) delays.add(core::seconds_of(now_ns - infos[i].source_timestamp));
    if (count > 0) dds_return_loan(reader, samples.data(), count);
  }
  dds_delete(participant);
}

}  // namespace prescene::benchmarks
