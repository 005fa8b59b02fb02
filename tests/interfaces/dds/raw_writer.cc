// SPDX-License-Identifier: Apache-2.0
#include "tests/interfaces/dds/raw_writer.h"

#include <algorithm>
#include <chrono>

#include <dds/dds.h>
#include <dds/ddsc/dds_opcodes.h>

namespace prescene::tests {
namespace {

// A type that is kBytes octets and nothing else. Without type information readers go by its name.
constexpr std::array<std::uint32_t, 4> kOctets = {
    static_cast<std::uint32_t>(DDS_OP_ADR) | static_cast<std::uint32_t>(DDS_OP_TYPE_ARR) |
        static_cast<std::uint32_t>(DDS_OP_SUBTYPE_1BY),
    0, static_cast<std::uint32_t>(RawWriter::kBytes), static_cast<std::uint32_t>(DDS_OP_RTS)};

}  // namespace

RawWriter::RawWriter(int domain, const std::string& topic, const std::string& type) : type_(type) {
  const dds_topic_descriptor_t octets{.m_size = static_cast<std::uint32_t>(kBytes),
                                      .m_align = 1,
                                      .m_flagset = 0,
                                      .m_nkeys = 0,
                                      .m_typename = type_.c_str(),
                                      .m_keys = nullptr,
                                      .m_nops = 2,
                                      .m_ops = kOctets.data(),
                                      .m_meta = "",
                                      .type_information = {},
                                      .type_mapping = {},
                                      .restrict_data_representation = 0};
  participant_ = dds_create_participant(static_cast<dds_domainid_t>(domain), nullptr, nullptr);
  dds_qos_t* qos = dds_create_qos();
  dds_qset_history(qos, DDS_HISTORY_KEEP_LAST, 100);
  dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, DDS_MSECS(100));
  // Serves readers that ask for latched messages, too.
  dds_qset_durability(qos, DDS_DURABILITY_TRANSIENT_LOCAL);
  const dds_data_representation_id_t xcdr1 = DDS_DATA_REPRESENTATION_XCDR1;
  dds_qset_data_representation(qos, 1, &xcdr1);
  writer_ = dds_create_writer(participant_, dds_create_topic(participant_, &octets, topic.c_str(), nullptr, nullptr),
                              qos, nullptr);
  dds_delete_qos(qos);
  waitset_ = dds_create_waitset(participant_);
  dds_set_status_mask(writer_, DDS_PUBLICATION_MATCHED_STATUS);
  dds_waitset_attach(waitset_, writer_, 1);
}

RawWriter::~RawWriter() { dds_delete(participant_); }

bool RawWriter::wait_for_reader() {
  const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(30);
  while (std::chrono::steady_clock::now() < until) {
    dds_publication_matched_status_t readers{};
    dds_get_publication_matched_status(writer_, &readers);
    if (readers.current_count > 0) return true;
    dds_attach_t triggered = 0;
    dds_waitset_wait(waitset_, &triggered, 1, DDS_MSECS(1000));
  }
  return false;
}

void RawWriter::write(std::span<const std::uint8_t> bytes) {
  std::array<std::uint8_t, kBytes> sample{};
  std::copy_n(bytes.begin(), std::min(bytes.size(), kBytes), sample.begin());
  static_cast<void>(dds_write(writer_, sample.data()));
}

}  // namespace prescene::tests
