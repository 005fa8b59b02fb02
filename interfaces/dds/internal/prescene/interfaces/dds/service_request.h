// SPDX-License-Identifier: Apache-2.0
// Requests to services of ROS 2 as rmw_cyclonedds_cpp sends them: a CDR message that begins with the client's number
// and that of its request.
#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "prescene/interfaces/dds/dds_node.h"

namespace prescene::interfaces {

/// What the fields of a request become.
enum class ServiceForm {
  kEmpty,   ///< None: it has none.
  kText,    ///< ServiceRequest::text: it has one, which is a text.
  kFields,  ///< ServiceRequest::fields: a message.
};

/// Of a CDR message: its header, the client and its request's number, and the request's own fields. Nothing where it is
/// none of this form, or longer than 4 MiB. The fields of kFields are not looked at.
std::optional<ServiceRequest> parse_request(std::span<const std::uint8_t> cdr, ServiceForm form);

}  // namespace prescene::interfaces
