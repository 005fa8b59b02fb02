// SPDX-License-Identifier: Apache-2.0
#include "prescene/interfaces/ros_messages/cdr.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <tuple>

#include "prescene/interfaces/ros_messages/image_view.h"

namespace prescene::interfaces {
namespace {

using core::StatusCode;
using testing::HasSubstr;

// What Cyclone DDS wrote for PoseStamped{7 s, 9 ns, "map", w = 1}.
std::vector<std::uint8_t> pose_stamped_bytes() {
  std::vector<std::uint8_t> bytes = {0x00, 0x01, 0x00, 0x00, 0x07, 0x00, 0x00, 0x00, 0x09, 0x00,
                                     0x00, 0x00, 0x04, 0x00, 0x00, 0x00, 'm',  'a',  'p',  0x00};
  bytes.resize(76, 0x00);
  bytes[74] = 0xf0;
  bytes[75] = 0x3f;
  return bytes;
}

TEST(Cdr, AgreesWithCycloneOnAPose) {
  RosPoseStamped pose;
  pose.header = {{7, 9}, "map"};
  EXPECT_EQ(encode_cdr(pose), pose_stamped_bytes());
  const auto decoded = decode_cdr<RosPoseStamped>(pose_stamped_bytes());
  ASSERT_TRUE(decoded.ok()) << decoded.status().message();
  EXPECT_EQ(*decoded, pose);
}

TEST(Cdr, CountsAlignmentFromTheByteAfterTheHeader) {
  RosObjectHypothesis hypothesis{"ab", 1.0};
  // Length 3 with NUL fills bytes 0 to 6 of the body; the double begins at 8.
  EXPECT_EQ(encode_cdr(hypothesis), (std::vector<std::uint8_t>{0, 1, 0, 0, 3, 0, 0,    0,   'a', 'b', 0, 0,  //
                                                               0, 0, 0, 0, 0, 0, 0xf0, 0x3f}));
}

TEST(Cdr, AcceptsWhatOtherWritersDo) {
  auto bytes = pose_stamped_bytes();
  bytes[3] = 2;  // Cyclone puts the number of pad bytes here.
  EXPECT_TRUE(decode_cdr<RosPoseStamped>(bytes).ok());
  bytes.resize(bytes.size() + 4);
  EXPECT_TRUE(decode_cdr<RosPoseStamped>(bytes).ok()) << "padding at the end";
  EXPECT_EQ(decode_cdr<RosString>(std::vector<std::uint8_t>{0, 1, 0, 0, 0, 0, 0, 0})->data, "")
      << "length 0 without NUL";
}

template <class Message>
core::Status decode_status(std::vector<std::uint8_t> bytes, const CdrLimits& limits = {}) {
  return decode_cdr<Message>(bytes, limits).status();
}

TEST(Cdr, SaysWhatIsWrongAndWhere) {
  const auto cut = decode_status<RosPoseStamped>({0, 1, 0, 0, 7, 0, 0, 0, 9, 0});
  EXPECT_EQ(cut.code(), StatusCode::kDataLoss);
  EXPECT_THAT(cut.message(),
              HasSubstr("geometry_msgs/msg/PoseStamped: header.stamp.nanosec, byte 8: the bytes end here"));

  const auto long_sequence =
      decode_status<RosPoseArray>({0,    1,    0,    0,   0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0,  //
                                   0xff, 0xff, 0xff, 0xff});
  EXPECT_EQ(long_sequence.code(), StatusCode::kDataLoss);
  EXPECT_THAT(long_sequence.message(), HasSubstr("poses, byte 24: a sequence of length 4294967295 needs at least"));

  const auto long_string = decode_status<RosString>({0, 1, 0, 0, 9, 0, 0, 0, 'a', 0});
  EXPECT_EQ(long_string.code(), StatusCode::kDataLoss);
  EXPECT_THAT(long_string.message(),
              HasSubstr("data, byte 8: a string of length 9 needs at least 9 bytes, 2 bytes are left"));

  const auto no_nul = decode_status<RosString>({0, 1, 0, 0, 2, 0, 0, 0, 'a', 'b'});
  EXPECT_EQ(no_nul.code(), StatusCode::kInvalidInput);
  EXPECT_THAT(no_nul.message(), HasSubstr("does not end with NUL"));

  std::vector<std::uint8_t> roi(4 + 17);
  roi[1] = 1;
  roi.back() = 2;
  EXPECT_THAT(decode_status<RosRegionOfInterest>(roi).message(), HasSubstr("do_rectify, byte 21: a bool is 2"));

  std::vector<std::uint8_t> left_over(4 + 8 + 9);
  left_over[1] = 1;
  EXPECT_THAT(decode_status<RosTime>(left_over).message(), HasSubstr("9 bytes are left over"));

  EXPECT_THAT(decode_status<RosTime>({0, 7, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0}).message(),
              HasSubstr("set the sender to XCDR1"));
  EXPECT_EQ(decode_status<RosTime>({0, 1, 0}).code(), StatusCode::kDataLoss);
}

TEST(Cdr, NamesTheElementOfASequence) {
  RosTfMessage message;
  message.transforms.resize(3);
  message.transforms[2].child_frame_id = "camera";
  auto bytes = encode_cdr(message);
  const std::string text(bytes.begin(), bytes.end());
  bytes[text.find("camera") + 6] = 'x';
  EXPECT_THAT(decode_status<RosTfMessage>(bytes).message(), HasSubstr("transforms[2].child_frame_id, byte"));
}

TEST(Cdr, KeepsToItsLimits) {
  EXPECT_EQ(decode_status<RosString>(encode_cdr(RosString{std::string(16 << 20, 'x')})).code(), StatusCode::kOk);
  EXPECT_EQ(decode_status<RosString>(encode_cdr(RosString{"four"}), {.max_string_bytes = 4}).code(), StatusCode::kOk);
  const auto status = decode_status<RosString>(encode_cdr(RosString{"fives"}), {.max_string_bytes = 4});
  EXPECT_EQ(status.code(), StatusCode::kResourceExhausted);
  EXPECT_THAT(status.message(), HasSubstr("longer than the limit of 4 bytes"));
  EXPECT_EQ(decode_status<RosString>(encode_cdr(RosString{"four"}), {.max_message_bytes = 8}).code(),
            StatusCode::kResourceExhausted);
}

TEST(Cdr, AnImageThatStaysWhereItIsIsTheSameAndHasTheSameErrors) {
  const RosImage image{{{7, 9}, "camera"}, 2, 3, "mono8", 0, 4, {1, 2, 3, 4, 5, 6, 7}};
  const std::vector<std::uint8_t> whole = encode_cdr(image);
  const auto view = view_image_cdr(whole);
  ASSERT_TRUE(view.ok()) << view.status().message();
  EXPECT_EQ(view->header, image.header);
  EXPECT_EQ(std::tuple(view->height, view->width, view->encoding, view->is_bigendian, view->step),
            std::tuple(image.height, image.width, image.encoding, image.is_bigendian, image.step));
  EXPECT_EQ(std::vector(view->data.begin(), view->data.end()), image.data);
  EXPECT_GE(view->data.data(), whole.data());
  EXPECT_LE(view->data.data() + view->data.size(), whole.data() + whole.size());
  for (std::size_t size = 0; size < whole.size(); ++size) {
    const std::span cut(whole.data(), size);
    ASSERT_EQ(view_image_cdr(cut).status(), decode_cdr<RosImage>(cut).status()) << size;
  }
}

}  // namespace
}  // namespace prescene::interfaces
