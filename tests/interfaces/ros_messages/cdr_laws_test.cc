// SPDX-License-Identifier: Apache-2.0
// The codec against bytes made from the message texts by another walk.
#include <gtest/gtest.h>
#include <rapidcheck.h>

#include "prescene/interfaces/ros_messages/cdr.h"
#include "prescene/interfaces/ros_messages/schemas.h"
#include "tests/interfaces/ros_messages/schema_walk.h"

namespace prescene::interfaces {
namespace {

template <class Message>
class CdrLaws : public testing::Test {
 protected:
  const tests::Schema schema_ = tests::parse_schema(ros_type<Message>().name, ros2msg_schema(ros_type<Message>()));
};

using AllMessages =
    testing::Types<RosTime, RosDuration, RosClock, RosHeader, RosString, RosColorRgba, RosVector3, RosPoint,
                   RosQuaternion, RosPose, RosPoseStamped, RosPoseWithCovariance, RosPoseWithCovarianceStamped,
                   RosPoseArray, RosTransform, RosTransformStamped, RosTfMessage, RosTwist, RosTwistStamped, RosImage,
                   RosCompressedImage, RosRegionOfInterest, RosCameraInfo, RosJointState, RosObjectHypothesis,
                   RosObjectHypothesisWithPose, RosBoundingBox3d, RosDetection3d, RosDetection3dArray, RosUvCoordinate,
                   RosMeshFile, RosMarker, RosMarkerArray, RosKeyValue, RosDiagnosticStatus, RosDiagnosticArray,
                   RosParameterEvent, RosParameterDescriptor, RosListParametersRequest, RosListParametersResponse,
                   RosGetParametersRequest, RosGetParametersResponse, RosGetParameterTypesResponse,
                   RosDescribeParametersResponse, RosSetParametersRequest, RosSetParametersResponse, RosSolidPrimitive,
                   RosMesh, RosPlane, RosObjectType, RosCollisionObject, RosObjectBelief, RosJointBelief, RosBelief,
                   RosEvent, RosQuery, RosCancel, RosAnswer, RosProgress>;
TYPED_TEST_SUITE(CdrLaws, AllMessages);

TYPED_TEST(CdrLaws, DecodingAndEncodingGivesTheBytesBackAndBothByteOrdersTheSameValues) {
  EXPECT_TRUE(rc::check([&](std::uint64_t seed) {
    const core::RandomStream stream(seed, core::Purpose::kTest);
    const auto little = tests::random_cdr(this->schema_, stream, std::endian::little);
    const auto message = decode_cdr<TypeParam>(little);
    RC_ASSERT(message.ok());
    RC_ASSERT(encode_cdr(*message) == little);
    const auto big = decode_cdr<TypeParam>(tests::random_cdr(this->schema_, stream, std::endian::big));
    RC_ASSERT(big.ok());
    RC_ASSERT(*big == *message);
  }));
}

TYPED_TEST(CdrLaws, EveryCutIsAClearError) {
  const core::RandomStream stream(7, core::Purpose::kTest);
  for (std::uint64_t step = 0; step < 4; ++step) {
    const auto bytes = tests::random_cdr(this->schema_, stream.at(step), std::endian::little);
    for (std::size_t length = 0; length < bytes.size(); ++length) {
      const auto status = decode_cdr<TypeParam>(std::span(bytes).first(length)).status();
      ASSERT_EQ(status.code(), core::StatusCode::kDataLoss) << length << " of " << bytes.size();
      ASSERT_TRUE(status.message().starts_with(ros_type<TypeParam>().name)) << status.message();
    }
  }
}

TYPED_TEST(CdrLaws, RandomDamageNeverCrashesAndWhatDecodesEncodesToASoundMessage) {
  EXPECT_TRUE(rc::check([&](std::uint64_t seed) {
    core::RandomStream stream(seed, core::Purpose::kTest);
    auto bytes = tests::random_cdr(this->schema_, stream, std::endian::little);
    for (int i = 0; i < 3; ++i) {
      bytes[stream.uniform_below(bytes.size())] = static_cast<std::uint8_t>(stream.uniform_below(256));
    }
    const auto message = decode_cdr<TypeParam>(bytes);
    if (!message) return;
    const auto again = decode_cdr<TypeParam>(encode_cdr(*message));
    RC_ASSERT(again.ok());
    RC_ASSERT(encode_cdr(*again) == encode_cdr(*message));
  }));
}

}  // namespace
}  // namespace prescene::interfaces
