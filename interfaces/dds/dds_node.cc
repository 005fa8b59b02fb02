// SPDX-License-Identifier: Apache-2.0
#include "prescene/interfaces/dds/dds_node.h"

#include <fcntl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <deque>
#include <exception>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <thread>
#include <utility>

#include <dds/dds.h>
#include <dds/ddsi/ddsi_serdata.h>
#include <dds/ddsrt/log.h>
#include "dds_configuration.h"
#include "dds_node_impl.h"
#include "security_files.h"
#include "topic_table.h"

namespace prescene::interfaces {

core::Status dds_status(dds_return_t code, const std::string& doing) {
  if (code >= 0) return core::ok_status();
  return core::unavailable(doing + ": " + dds_strretcode(-code) +
                           "; Cyclone DDS gives the cause above, CYCLONEDDS_URI sets it up");
}

namespace {

/// Cyclone takes some ten descriptors for a domain and, where it finds none, ends the program when it cleans up.
core::Status check_descriptors() {
  constexpr std::size_t kDescriptors = 16;
  std::array<int, kDescriptors> spare{};
  for (int& descriptor : spare) descriptor = ::open("/dev/null", O_RDONLY | O_CLOEXEC);
  const bool enough = std::none_of(spare.begin(), spare.end(), [](int descriptor) { return descriptor < 0; });
  for (const int descriptor : spare) {
    if (descriptor >= 0) ::close(descriptor);
  }
  if (enough) return core::ok_status();
  return core::unavailable("DDS needs " + std::to_string(kDescriptors) +
                           " file descriptors, and there are not so many left: raise `ulimit -n`");
}

}  // namespace

std::optional<int> granted_receive_buffer(int asked) {
  const int socket = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  if (socket < 0) return std::nullopt;
  int granted = 0;
  socklen_t size = sizeof(granted);
  const bool answered = ::setsockopt(socket, SOL_SOCKET, SO_RCVBUF, &asked, sizeof(asked)) == 0 &&
                        ::getsockopt(socket, SOL_SOCKET, SO_RCVBUF, &granted, &size) == 0;
  ::close(socket);
  if (!answered) return std::nullopt;
  return granted / 2;  // Linux doubles it for its own bookkeeping
}

namespace {

/// Reads the names of the network interfaces off Cyclone's trace, which has no other way to name them.
class InterfaceListener {
 public:
  explicit InterfaceListener(bool listens) : listens_(listens) {
    if (!listens_) return;
    dds_set_trace_sink(
        [](void* self, const dds_log_data_t* line) {
          constexpr std::string_view kBegin = "selected interfaces: ";
          const std::string_view text(line->message, line->size);
          const std::size_t at = text.find(kBegin);
          if (at == std::string_view::npos) return;
          const std::string_view rest = text.substr(at + kBegin.size());
          static_cast<InterfaceListener*>(self)->found_ = rest.substr(0, rest.find_last_not_of(" \n") + 1);
        },
        this);
  }
  ~InterfaceListener() {
    if (listens_) dds_set_trace_sink(nullptr, nullptr);
  }
  InterfaceListener(const InterfaceListener&) = delete;
  InterfaceListener& operator=(const InterfaceListener&) = delete;

  std::string take() const { return found_; }

 private:
  bool listens_;
  std::string found_;
};

void check_buffer(const DdsOptions& options, const core::LogSink& log) {
  const std::optional<int> granted = granted_receive_buffer(options.receive_buffer_bytes);
  if (!granted || *granted >= options.receive_buffer_bytes) return;
  core::log(
      log, core::LogLevel::kWarning,
      "the system grants a receive buffer of " + std::to_string(*granted >> 10) + " KiB instead of " +
          std::to_string(options.receive_buffer_bytes >> 10) +
          " KiB, so images may be lost: sysctl -w net.core.rmem_max=" + std::to_string(options.receive_buffer_bytes));
}

/// The bytes of a sample where Cyclone keeps them, for as long as this lives.
class SerialisedBytes {
 public:
  SerialisedBytes(const ddsi_serdata* sample, std::size_t size)
      : held_(ddsi_serdata_to_ser_ref(sample, 0, size, &bytes_)) {}
  ~SerialisedBytes() { ddsi_serdata_to_ser_unref(held_, &bytes_); }
  SerialisedBytes(const SerialisedBytes&) = delete;
  SerialisedBytes& operator=(const SerialisedBytes&) = delete;

  std::vector<std::uint8_t> copy() const {
    const auto* begin = static_cast<const std::uint8_t*>(bytes_.iov_base);
    return {begin, begin + bytes_.iov_len};
  }

 private:
  ddsrt_iovec_t bytes_{};
  ddsi_serdata* held_;
};

/// Subscriptions that the threads of Cyclone DDS were given. They take this before they count in one: that it was made
/// before is ordered by Cyclone's locks as well, but no sanitizer sees these.
std::atomic<std::uint64_t> handed_over{0};

}  // namespace

void DdsNode::Impl::run() {
  std::array<dds_attach_t, 64> triggered{};
  for (bool has_more = false; !stopping;) {
    const dds_return_t count =
        dds_waitset_wait(waitset, triggered.data(), triggered.size(), has_more ? 0 : DDS_INFINITY);
    if (count < 0) return;
    const auto filled = std::min(static_cast<std::size_t>(count), triggered.size());
    const std::span came(triggered.data(), filled);
    std::size_t subscribed = 0;
    {
      const std::lock_guard lock(mutex);
      subscribed = subscriptions.size();
    }
    // Each in turn, those that have more and those of which something came.
    has_more = false;
    for (std::size_t i = 0; i < subscribed && !stopping; ++i) {
      Subscription* subscription = nullptr;
      {
        const std::lock_guard lock(mutex);
        subscription = &subscriptions[i];
      }
      const bool has_come = std::find(came.begin(), came.end(), static_cast<dds_attach_t>(i + 1)) != came.end();
      if (!has_come && !subscription->has_more) continue;
      take(*subscription);
      has_more = has_more || subscription->has_more;
    }
  }
}

void DdsNode::Impl::take(Subscription& subscription) {
  constexpr std::uint32_t kBatch = 16;
  // More than the deepest history (topic_table.cc), so that what has arrived by now is taken below, or was overwritten,
  // however fast more comes.
  constexpr int kBatches = 7;
  const std::uint64_t arrived = subscription.arrived.load(std::memory_order_acquire);
  subscription.has_more = true;
  for (int batch = 0; batch < kBatches && subscription.has_more; ++batch) {
    ddsi_serdata* samples[kBatch] = {};
    dds_sample_info_t infos[kBatch];
    const dds_return_t count = dds_takecdr(subscription.reader, samples, kBatch, infos, DDS_ANY_STATE);
    for (dds_return_t i = 0; i < count; ++i) {
      try {
        if (infos[i].valid_data && !stopping) deliver(subscription, samples[i], infos[i]);
      } catch (const std::exception&) {
        dropped.fetch_add(1, std::memory_order_relaxed);
      }
      ddsi_serdata_unref(samples[i]);
    }
    subscription.has_more = count == static_cast<dds_return_t>(kBatch) && !stopping;
  }
  // What came after that may have pushed out more, and nothing else may come: it is looked at once more.
  if (!stopping && subscription.arrived.load(std::memory_order_acquire) != arrived) subscription.has_more = true;
  count_losses(subscription, arrived);
}

void DdsNode::Impl::deliver(Subscription& subscription, const ddsi_serdata* sample, const dds_sample_info_t& info) {
  ++subscription.taken;
  const std::size_t size = ddsi_serdata_size(sample);
  if (size > options.max_message_bytes) {
    dropped.fetch_add(1, std::memory_order_relaxed);
    return;
  }
  const SerialisedBytes bytes(sample, size);
  subscription.on_message({subscription.topic, subscription.type, bytes.copy(), info.source_timestamp,
                           core::steady_now_ns(), info.publication_handle});
}

// Cyclone's own count of lost samples leaves out those that newer ones push out of the reader's history.
void DdsNode::Impl::count_losses(Subscription& subscription, std::uint64_t arrived) {
  const std::uint64_t overwritten = arrived > subscription.taken ? arrived - subscription.taken : 0;
  if (overwritten <= subscription.reported_overwritten) return;
  dropped.fetch_add(overwritten - subscription.reported_overwritten, std::memory_order_relaxed);
  subscription.reported_overwritten = overwritten;
}

core::Result<dds_entity_t> DdsNode::Impl::make_topic(const std::string& topic, const std::string& type) const {
  PRESCENE_TRY(const std::string name, dds_topic_name(topic));
  const dds_topic_descriptor_t* descriptor = descriptor_of(type);
  if (!descriptor)
    return core::unsupported("topic " + topic + ": the type '" + type + "' is not one that this program speaks");
  const dds_entity_t entity = dds_create_topic(participant, descriptor, name.c_str(), nullptr, nullptr);
  PRESCENE_RETURN_IF_ERROR(dds_status(entity, "topic " + topic + " of " + type));
  return entity;
}

void DdsNode::Impl::announce() {
  if (!graph) return;
  std::vector<dds_entity_t> readers;
  std::vector<dds_entity_t> writers;
  for (const Subscription& subscription : subscriptions) readers.push_back(subscription.reader);
  for (const Publication& publication : publications) writers.push_back(publication.writer);
  for (const Service& service : services) writers.push_back(service.replies);
  graph->publish(options.node_name, readers, writers);
}

DdsNode::DdsNode(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
DdsNode::~DdsNode() = default;

core::Result<std::unique_ptr<DdsNode>> DdsNode::create(const DdsOptions& options, const core::LogSink& log) {
  // 0.10's port mapping overflows 65535 beyond domain 232; ROS allows up to 230 with the default port range.
  if (options.domain < 0 || options.domain > 230) {
    return core::invalid_input("DDS domain " + std::to_string(options.domain) +
                               ": ROS_DOMAIN_ID is a number from 0 to 230");
  }
  PRESCENE_RETURN_IF_ERROR(check_network(options));
  PRESCENE_RETURN_IF_ERROR(check_descriptors());
  auto impl = std::make_unique<Impl>();
  impl->options = options;
  impl->cyclone_log.emplace(options.domain, log);
  const auto domain_id = static_cast<dds_domainid_t>(options.domain);
  InterfaceListener listener(options.find_interfaces);
  const dds_entity_t domain = dds_create_domain(domain_id, configuration_of(options).c_str());
  // A second node of this process finds the domain made already and shares its configuration.
  if (domain < 0 && domain != DDS_RETCODE_PRECONDITION_NOT_MET) {
    return dds_status(domain, "DDS domain " + std::to_string(options.domain));
  }
  QosPtr qos(dds_create_qos());
  const std::string enclave = "enclave=/;";
  dds_qset_userdata(qos.get(), enclave.data(), enclave.size());
  dds_qset_entity_name(qos.get(), options.node_name.c_str());
  if (!options.security.empty()) PRESCENE_RETURN_IF_ERROR(use_security(options.security, qos.get()));
  impl->participant = dds_create_participant(domain_id, qos.get(), nullptr);
  PRESCENE_RETURN_IF_ERROR(
      dds_status(impl->participant, "DDS participant in domain " + std::to_string(options.domain)));
  impl->interfaces = listener.take();
  impl->census.set_participant(impl->participant);
  impl->waitset = dds_create_waitset(impl->participant);
  PRESCENE_RETURN_IF_ERROR(dds_status(impl->waitset, "DDS waitset"));
  impl->stop = dds_create_guardcondition(impl->participant);
  PRESCENE_RETURN_IF_ERROR(dds_status(impl->stop, "DDS guard condition"));
  PRESCENE_RETURN_IF_ERROR(dds_status(dds_waitset_attach(impl->waitset, impl->stop, 0), "DDS waitset"));
  if (options.ros_distro) {
    PRESCENE_TRY(impl->graph, GraphAnnouncement::create(impl->participant, *options.ros_distro));
    impl->announce();
  }
  check_buffer(options, log);
  impl->thread = std::thread([raw = impl.get()] { raw->run(); });
  return std::unique_ptr<DdsNode>(new DdsNode(std::move(impl)));
}

core::Status DdsNode::Impl::listen(const std::string& topic, const std::string& type, dds_entity_t topic_entity,
                                   const QosPtr& qos, std::function<void(ReceivedMessage&&)> on_message) {
  Subscription& subscription = subscriptions.emplace_back();
  subscription.topic = topic;
  subscription.type = type;
  subscription.on_message = std::move(on_message);
  // A filter that lets everything pass sees each sample before it enters the history, from where newer ones push it
  // out.
  dds_topic_filter filter{};
  filter.mode = DDS_TOPIC_FILTER_SAMPLEINFO_ARG;
  filter.f.sampleinfo_arg = [](const dds_sample_info_t*, void* arrived) {
    static_cast<void>(handed_over.load(std::memory_order_acquire));
    static_cast<std::atomic<std::uint64_t>*>(arrived)->fetch_add(1, std::memory_order_release);
    return true;
  };
  filter.arg = &subscription.arrived;
  handed_over.fetch_add(1, std::memory_order_release);
  core::Status made = dds_status(dds_set_topic_filter_extended(topic_entity, &filter), "topic " + topic);
  dds_entity_t reader = 0;
  if (made.ok()) {
    reader = dds_create_reader(participant, topic_entity, qos.get(), nullptr);
    made = dds_status(reader, "reader of " + topic);
  }
  if (!made.ok()) {
    subscriptions.pop_back();
    return made;
  }
  subscription.reader = reader;
  announce();
  dds_set_status_mask(reader, DDS_DATA_AVAILABLE_STATUS);
  return dds_status(dds_waitset_attach(waitset, reader, static_cast<dds_attach_t>(subscriptions.size())),
                    "reader of " + topic);
}

core::Status DdsNode::subscribe(const std::string& topic, const std::string& type, TopicQos qos,
                                std::function<void(ReceivedMessage&&)> on_message) {
  PRESCENE_TRY(const dds_entity_t topic_entity, impl_->make_topic(topic, type));
  const std::lock_guard lock(impl_->mutex);
  return impl_->listen(topic, type, topic_entity, make_qos(qos, type), std::move(on_message));
}

core::Result<DdsPublisher> DdsNode::advertise(const std::string& topic, const std::string& type, TopicQos qos) {
  PRESCENE_TRY(const dds_entity_t topic_entity, impl_->make_topic(topic, type));
  const dds_entity_t writer = dds_create_writer(impl_->participant, topic_entity, make_qos(qos, type).get(), nullptr);
  PRESCENE_RETURN_IF_ERROR(dds_status(writer, "writer of " + topic));
  const std::lock_guard lock(impl_->mutex);
  impl_->publications.push_back({topic, type, writer});
  impl_->announce();
  return DdsPublisher{static_cast<int>(impl_->publications.size()) - 1};
}

void DdsNode::stop_receiving() { impl_->stop_receiving(); }

int DdsNode::matched_readers(DdsPublisher publisher) const {
  const std::lock_guard lock(impl_->mutex);
  dds_publication_matched_status_t status;
  const dds_entity_t writer = impl_->publications[static_cast<std::size_t>(publisher.index)].writer;
  return dds_get_publication_matched_status(writer, &status) == DDS_RETCODE_OK ? static_cast<int>(status.current_count)
                                                                               : 0;
}

std::uint64_t DdsNode::readers_so_far(DdsPublisher publisher) const {
  const std::lock_guard lock(impl_->mutex);
  dds_publication_matched_status_t status;
  const dds_entity_t writer = impl_->publications[static_cast<std::size_t>(publisher.index)].writer;
  return dds_get_publication_matched_status(writer, &status) == DDS_RETCODE_OK ? status.total_count : 0;
}

int DdsNode::matched_writers(const std::string& topic) const {
  const std::lock_guard lock(impl_->mutex);
  for (const Impl::Subscription& subscription : impl_->subscriptions) {
    dds_subscription_matched_status_t status;
    if (subscription.topic == topic &&
        dds_get_subscription_matched_status(subscription.reader, &status) == DDS_RETCODE_OK) {
      return static_cast<int>(status.current_count);
    }
  }
  return 0;
}

int DdsNode::other_writers(const std::string& topic) const {
  const auto name = dds_topic_name(topic);
  return name ? impl_->census.writers_of(*name) : 0;
}

std::vector<DomainTopic> DdsNode::domain_topics() const { return impl_->census.topics(); }
int DdsNode::other_participants() const { return impl_->census.participants(); }
std::string DdsNode::interfaces() const { return impl_->interfaces; }

std::uint64_t DdsNode::dropped_samples() const { return impl_->dropped.load(std::memory_order_relaxed); }

}  // namespace prescene::interfaces
