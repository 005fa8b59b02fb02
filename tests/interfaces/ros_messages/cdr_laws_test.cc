// SPDX-License-Identifier: Apache-2.0
// The codec against bytes made from the message texts by another walk.
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cstdint>
#include <ostream>
#include <span>
#include <string>
#include <vector>

#include "prescene/interfaces/ros_messages/cdr.h"
#include "prescene/interfaces/ros_messages/schemas.h"
#include "tests/interfaces/ros_messages/schema_walk.h"
#include "tests/support/laws.h"

namespace prescene::interfaces {
namespace {

using CdrBytes = std::vector<std::uint8_t>;

/// The codec of one message type as a function of bytes. The laws themselves are compiled once, not for each type.
struct Codec {
  const RosType* type = nullptr;
  /// Decodes, and encodes what came of it.
  core::Result<CdrBytes> (*again)(std::span<const std::uint8_t>) = nullptr;
};

template <class Message>
core::Result<CdrBytes> decode_and_encode(std::span<const std::uint8_t> bytes) {
  PRESCENE_TRY(const Message message, decode_cdr<Message>(bytes));
  return encode_cdr(message);
}

template <class... Messages>
std::vector<Codec> codecs_of() {
  return {Codec{&ros_type<Messages>(), &decode_and_encode<Messages>}...};
}

std::vector<Codec> all_codecs() {
  return codecs_of<RosTime, RosDuration, RosClock, RosHeader, RosString, RosColorRgba, RosVector3, RosPoint,
                   RosQuaternion, RosPose, RosPoseStamped, RosPoseWithCovariance, RosPoseWithCovarianceStamped,
                   RosPoseArray, RosTransform, RosTransformStamped, RosTfMessage, RosTwist, RosTwistStamped, RosImage,
                   RosCompressedImage, RosRegionOfInterest, RosCameraInfo, RosJointState, RosObjectHypothesis,
                   RosObjectHypothesisWithPose, RosBoundingBox3d, RosDetection3d, RosDetection3dArray, RosUvCoordinate,
                   RosMeshFile, RosMarker, RosMarkerArray, RosKeyValue, RosDiagnosticStatus, RosDiagnosticArray,
                   RosParameterEvent, RosParameterDescriptor, RosListParametersRequest, RosListParametersResponse,
                   RosGetParametersRequest, RosGetParametersResponse, RosGetParameterTypesResponse,
                   RosDescribeParametersResponse, RosSetParametersRequest, RosSetParametersResponse, RosSolidPrimitive,
                   RosMesh, RosPlane, RosObjectType, RosCollisionObject, RosObjectBelief, RosJointBelief, RosBelief,
                   RosEvent, RosQuery, RosCancel, RosAnswer, RosProgress>();
}

std::ostream& operator<<(std::ostream& out, const Codec& codec) { return out << codec.type->name; }

class CdrLaws : public testing::TestWithParam<Codec> {
 protected:
  const Codec& codec_ = GetParam();
  const tests::Schema schema_ = tests::parse_schema(codec_.type->name, ros2msg_schema(*codec_.type));
};

TEST_P(CdrLaws, DecodingAndEncodingGivesTheBytesBackAndBothByteOrdersTheSameValues) {
  EXPECT_TRUE(tests::check_law([&](std::uint64_t seed) {
    const core::RandomStream stream(seed, core::Purpose::kTest);
    const CdrBytes little = tests::random_cdr(schema_, stream, std::endian::little);
    for (const std::endian order : {std::endian::little, std::endian::big}) {
      const auto again = codec_.again(tests::random_cdr(schema_, stream, order));
      RC_ASSERT(again.ok());
      RC_ASSERT(*again == little);
    }
  }));
}

TEST_P(CdrLaws, EveryCutIsAClearError) {
  const core::RandomStream stream(7, core::Purpose::kTest);
  for (std::uint64_t step = 0; step < 4; ++step) {
    const CdrBytes bytes = tests::random_cdr(schema_, stream.at(step), std::endian::little);
    for (std::size_t length = 0; length < bytes.size(); ++length) {
      const auto status = codec_.again(std::span(bytes).first(length)).status();
      ASSERT_EQ(status.code(), core::StatusCode::kDataLoss) << length << " of " << bytes.size();
      ASSERT_TRUE(status.message().starts_with(codec_.type->name)) << status.message();
    }
  }
}

TEST_P(CdrLaws, RandomDamageNeverCrashesAndWhatDecodesEncodesToASoundMessage) {
  EXPECT_TRUE(tests::check_law([&](std::uint64_t seed) {
    core::RandomStream stream(seed, core::Purpose::kTest);
    CdrBytes bytes = tests::random_cdr(schema_, stream, std::endian::little);
    for (int i = 0; i < 3; ++i) {
      bytes[stream.uniform_below(bytes.size())] = static_cast<std::uint8_t>(stream.uniform_below(256));
    }
    const auto encoded = codec_.again(bytes);
    if (!encoded.ok()) return;
    const auto again = codec_.again(*encoded);
    RC_ASSERT(again.ok());
    RC_ASSERT(*again == *encoded);
  }));
}

/// "geometry_msgs/msg/Pose" -> "geometry_msgs_msg_Pose".
std::string codec_name(const testing::TestParamInfo<Codec>& info) {
  std::string name(info.param.type->name);
  std::replace(name.begin(), name.end(), '/', '_');
  return name;
}

INSTANTIATE_TEST_SUITE_P(Messages, CdrLaws, testing::ValuesIn(all_codecs()), codec_name);

}  // namespace
}  // namespace prescene::interfaces
