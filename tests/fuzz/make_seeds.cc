// SPDX-License-Identifier: Apache-2.0
// Writes the seeds of the fuzz targets: make_fuzz_seeds FOLDER. Small, sound inputs of every kind that the decoders
// know.
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <initializer_list>
#include <string>
#include <utility>

#include "prescene/collision/tree_file.h"
#include "prescene/core/check.h"
#include "prescene/geometry/primitives.h"
#include "prescene/interfaces/bytes/file.h"
#include "prescene/interfaces/images/jpeg.h"
#include "prescene/interfaces/images/png.h"
#include "prescene/interfaces/mcap/mcap_writer.h"
#include "prescene/interfaces/mesh_files/import_reply.h"
#include "prescene/interfaces/mesh_files/mesh_file.h"
#include "prescene/interfaces/ros_messages/cdr.h"
#include "prescene/interfaces/ros_messages/conversions.h"
#include "prescene/interfaces/ros_messages/schemas.h"
#include "prescene/service/training/proposals_file.h"
#include "tests/interfaces/bags/db3_files.h"
#include "tests/interfaces/images/rvl_coder.h"
#include "tests/interfaces/ros_messages/schema_walk.h"
#include "tests/support/paths.h"
#include "tree_kinds.h"

using namespace prescene;              // NOLINT(google-build-using-namespace)
using namespace prescene::interfaces;  // NOLINT(google-build-using-namespace)

namespace {

std::filesystem::path corpus;

void write_seed(const std::string& target, const std::string& name, std::span<const std::uint8_t> bytes) {
  std::filesystem::create_directories(corpus / target);
  PRESCENE_CHECK(write_file(corpus / target / ("seed_" + name), bytes).ok());
}

void write_seed(const std::string& target, const std::string& name, const std::string& text) {
  write_seed(target, name, std::span(reinterpret_cast<const std::uint8_t*>(text.data()), text.size()));
}

void write_image_seeds() {
  geometry::ColorImage color(9, 7);
  geometry::DepthImage depth(9, 7);
  geometry::Image<std::uint8_t> label(9, 7);
  for (int y = 0; y < 7; ++y) {
    for (int x = 0; x < 9; ++x) {
      color(x, y) = {static_cast<std::uint8_t>(20 * x), static_cast<std::uint8_t>(30 * y), 99};
      depth(x, y) = 0.5F + 0.01F * static_cast<float>(x * y);
      label(x, y) = static_cast<std::uint8_t>(x / 3);
    }
  }
  write_seed("png", "color", encode_png(std::as_const(color).view()));
  write_seed("png", "depth", encode_png_depth(std::as_const(depth).view(), 0.001));
  write_seed("png", "label", encode_png(std::as_const(label).view()));
  write_seed("jpeg", "quality_50", encode_jpeg(std::as_const(color).view(), 50));
  write_seed("jpeg", "quality_95", encode_jpeg(std::as_const(color).view(), 95));

  const std::string columns = "frame,color,depth,m00,m01,m02,m03,m10,m11,m12,m13,m20,m21,m22,m23,m30,m31,m32,m33";
  const std::string pose = "a,a.color.png,a.depth.png,0,-1,0,0.5,1,0,0,-0.25,0,0,1,2,0,0,0,1";
  const std::string camera = std::string(1, '\0') + "10 0 1.5\n0 10 1\n0 0 1\n";
  write_seed("frame_folder", "rate", columns + "\n" + pose + "\n" + pose + "\n" + camera);
  write_seed("frame_folder", "stamps", columns + ",stamp_ns\r\n" + pose + ",5\r\n" + pose + ",9\r\n" + camera);
}

void write_mesh_seeds() {
  const geometry::TriangleMesh box = geometry::make_mesh(geometry::BoxShape{{0.1, 0.2, 0.3}});
  write_seed("ply", "binary", encode_ply(box));
  write_seed("ply", "text", encode_ply(box, MeshEncoding::kText, std::vector<geometry::Rgb>(8, {1, 2, 3})));
  write_seed(
      "ply", "lists",
      std::string(
          "ply\nformat ascii 1.0\nelement a 1\nproperty list uchar float l\nelement vertex 4\nproperty double x\n"
          "property float y\nproperty short z\nelement face 1\nproperty uchar f\nproperty list int uint "
          "vertex_index\nend_header\n2 1 2\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n9 4 0 1 2 3\n"));
  write_seed("ply", "big_endian",
             std::string(
                 "ply\nformat binary_big_endian 1.0\nelement vertex 3\nproperty char x\nproperty char y\nproperty char "
                 "z\nelement face 1\nproperty list uchar uchar vertex_indices\nend_header\n") +
                 std::string("\0\0\0\1\0\0\0\1\0\3\0\1\2", 13));
  write_seed("obj", "box", encode_obj(box));
  write_seed("obj", "forms",
             std::string("# x\nv 0 0 0 1 0 0\nv 1 0 0 1\nv 1 1 0\nv 0 1 0\nvn 0 0 1\nf 1/1/1 2//2 -2 \\\n 4\n"));
  write_seed("stl", "binary", encode_stl(box));
  write_seed("stl", "text", encode_stl(box, MeshEncoding::kText));
  for (const auto& [name, answer] : std::initializer_list<std::pair<const char*, core::Result<ImportedMesh>>>{
           {"mesh", ImportedMesh{box, "", false}},
           {"not_finite", ImportedMesh{box, "vertex 7 (mesh 2)", false}},
           {"refusal", core::invalid_input("'GLTF: no such node'")},
           {"too_large", core::resource_exhausted("has more than the limit")}}) {
    const auto bytes = run_in_child([&answer = answer](ChildOutput& out) { send_reply(answer, out); }, {});
    PRESCENE_CHECK(bytes.ok());
    write_seed("import_reply", name, *bytes);
  }
}

void write_tree_file_seeds() {
  const collision::TreeFileKey key{.kind = "fuzz", .layout = 1, .mesh_hash = 1, .settings_hash = 2};
  const std::vector<std::uint32_t> words = {1, 2, 3, 4, 5};
  const std::vector<std::uint64_t> longs(17, 9);
  const std::vector<std::uint8_t> bytes(65, 7);
  write_seed("tree_file", "empty", collision::TreeFileWriter(key).bytes());
  write_seed("tree_file", "one", collision::TreeFileWriter(key).add(std::span(words)).bytes());
  collision::TreeFileWriter three(key);
  three.add(std::span(longs)).add(std::span<const std::uint32_t>()).add(std::span(bytes));
  write_seed("tree_file", "three", three.bytes());
  write_seed("tree_file", "other_kind", collision::TreeFileWriter({.kind = "other"}).add(std::span(words)).bytes());
}

void write_tree_seeds() {
  core::ThreadPool one(1);
  for (std::size_t kind = 0; kind < tests::kTreeKinds; ++kind) {
    tests::visit_tree_kind(kind, [&]<class Tree>(const auto& options) {
      std::vector<std::uint8_t> bytes = tests::file_bytes(Tree::build(tests::tree_kinds_mesh(), options, one));
      bytes.insert(bytes.begin(), static_cast<std::uint8_t>(kind));
      write_seed("trees", std::to_string(kind), bytes);
    });
  }
}

void write_recording_seed(const std::string& name, McapCompression compression, std::size_t chunk_bytes) {
  const tests::ScratchDir scratch;
  auto writer = McapWriter::create(scratch.path() / "a", {.compression = compression, .chunk_bytes = chunk_bytes});
  PRESCENE_CHECK(writer.ok());
  const int a = *(*writer)->add_channel({"/1", "cdr", {"pkg/msg/T", "ros2msg", "uint8[] d\n"}, {{"k", "v"}}});
  const int b = *(*writer)->add_channel({"/2", "json", {}, {}});
  for (std::uint32_t i = 0; i < 12; ++i) {
    const std::vector<std::uint8_t> data(200, static_cast<std::uint8_t>(i));
    PRESCENE_CHECK((*writer)->write({i % 3 == 0 ? b : a, i, i * 10, i, data}).ok());
    if (i == 5) PRESCENE_CHECK((*writer)->write_metadata({"m", {{"k", "v"}}}).ok());
  }
  PRESCENE_CHECK((*writer)->close().ok());
  write_seed("mcap", name, *read_file(scratch.path() / "a", 1 << 20));
}

/// A request: which service of parameters, then the message with rmw's header before its fields.
template <class Message>
void write_request_seeds(std::uint8_t service, const std::string& name, const std::vector<Message>& sound) {
  const auto with_identity = [service](std::vector<std::uint8_t> cdr) {
    constexpr std::size_t kHeader = 4;
    const std::vector<std::uint8_t> identity = {9, 8, 7, 6, 5, 4, 3, 2, 1, 0, 0, 0, 0, 0, 0, 0};
    cdr.insert(cdr.begin() + kHeader, identity.begin(), identity.end());
    cdr.insert(cdr.begin(), service);
    return cdr;
  };
  const RosType& type = ros_type<Message>();
  const tests::Schema schema = tests::parse_schema(type.name, ros2msg_schema(type));
  const core::RandomStream stream(service + 10U, core::Purpose::kTest);
  for (const std::endian order : {std::endian::little, std::endian::big})
    write_seed("service_request", name + (order == std::endian::big ? "_big" : "_little"),
               with_identity(tests::random_cdr(schema, stream, order)));
  for (std::size_t i = 0; i < sound.size(); ++i)
    write_seed("service_request", name + "_" + std::to_string(i), with_identity(encode_cdr(sound[i])));
}

void write_service_request_seeds() {
  const std::vector<std::string> names = {"a.number", "a.whole", "truth", "word", "text", "row", "fixed", "none"};
  write_request_seeds<RosListParametersRequest>(0, "list", {{{}, 0}, {{"a", "truth"}, 1}});
  write_request_seeds<RosGetParametersRequest>(1, "get", {{names}});
  write_request_seeds<RosGetParameterTypesRequest>(2, "types", {{names}});
  write_request_seeds<RosDescribeParametersRequest>(3, "describe", {{names}});
  std::vector<RosParameter> set;
  for (const std::string& name : names)
    for (const std::uint8_t type : {1, 2, 3, 4, 8}) {
      RosParameterValue value;
      value.type = type;
      value.bool_value = true;
      value.integer_value = 1;
      value.double_value = 0.25;
      value.string_value = "error";
      value.double_array_value = {1.0, 2.0};
      set.push_back({name, value});
    }
  write_request_seeds<RosSetParametersRequest>(4, "set", {{set}});
  const std::vector<RosParameter> allowed = {set[2], set[6], set[10], set[18], set[23], set[29]};
  write_request_seeds<RosSetParametersAtomicallyRequest>(5, "set_atomically", {{allowed}, {set}});
}

void write_proposals_seeds() {
  filter::LearnedProposals proposals;
  write_seed("proposals", "empty", service::encode_proposals(proposals));
  for (const int patches : {1, 3}) {
    filter::LearnedModel& model = proposals.models.emplace_back();
    model.name = "model_" + std::to_string(patches);
    model.rests = {{{0.0F, 0.0F, 1.0F}, 0.75F}, {{1.0F, 0.0F, 0.0F}, 0.25F}};
    model.patches.resize(static_cast<std::size_t>(patches));
    model.X_AO.resize(static_cast<std::size_t>(patches));
    for (filter::SurfacePatch& patch : model.patches) patch.relief.fill(static_cast<std::uint8_t>(100 + patches));
  }
  write_seed("proposals", "models", service::encode_proposals(proposals));
  proposals.fit.trees.resize(1);
  write_seed("proposals", "tree", service::encode_proposals(proposals));
}

void write_bag_metadata_seeds() {
  write_seed("bag_metadata", "mcap", tests::bag_metadata("mcap", {"a.mcap"}, 1));
  write_seed("bag_metadata", "db3", tests::bag_metadata("sqlite3", {"b.db3"}, 1));
  write_seed("bag_metadata", "both", tests::bag_metadata("mcap", {"a.mcap", "bag/b.db3"}, 2));
  write_seed("bag_metadata", "outside", tests::bag_metadata("mcap", {"../out.mcap"}, 1));
  std::string packed = tests::bag_metadata("mcap", {"a.mcap"}, 1);
  packed.replace(packed.find("compression_format: \"\""), 22, "compression_format: zstd");
  packed.replace(packed.find("compression_mode: \"\""), 20, "compression_mode: MESSAGE");
  write_seed("bag_metadata", "packed", packed);
}

/// Programs for frames_fuzz.cc: a byte says what comes, and each of its values takes one or more.
void write_frames_seeds() {
  using Program = std::vector<std::uint8_t>;
  const auto after = [](std::initializer_list<Program> parts) {
    Program program;
    for (const Program& part : parts) program.insert(program.end(), part.begin(), part.end());
    return program;
  };
  const Program info = {3, 4, 4, 0, 0, 0, 0, 0};
  const Program distorted = {3, 4, 4, 0, 5, 3, 3, 3, 3, 3, 0, 0, 0};
  const auto tf = [](std::uint8_t time, std::uint8_t child, bool is_static) {
    return Program{4, 1, time, 0, child, 0, 1, 3, 0, static_cast<std::uint8_t>(is_static ? 0 : 1)};
  };
  const auto depth = [](std::uint8_t time) { return Program{0, time, 1, 0, 4, 4, 0, 3, 200, 3, 210, 3}; };
  const auto color = [](std::uint8_t time) { return Program{2, time, 1, 2, 4, 4, 0, 3, 10, 20, 30, 40}; };
  const Program wait_100_ms = {5, 100, 0};
  const Program back_an_hour = {5, 0, 0x80};
  const Program skipped = {6};
  write_seed("frames", "plain",
             after({{1}, tf(0, 1, true), info, color(3), depth(3), wait_100_ms, depth(4), wait_100_ms}));
  write_seed("frames", "moving",
             after({{0}, info, tf(1, 1, false), tf(3, 1, false), tf(2, 3, false), depth(2), wait_100_ms, skipped}));
  write_seed("frames", "clock_back",
             after({{8}, distorted, depth(200), wait_100_ms, depth(1), back_an_hour, wait_100_ms, depth(2), skipped}));
  write_seed("frames", "odd", after({{31}, info, depth(255), {0, 3, 1, 1, 4, 4, 1, 7, 3, 1, 2, 3}, wait_100_ms}));
}

template <class Message>
void write_message_seeds(const std::string& target) {
  const RosType& type = ros_type<Message>();
  const tests::Schema schema = tests::parse_schema(type.name, ros2msg_schema(type));
  const core::RandomStream stream(1, core::Purpose::kTest);
  for (std::uint64_t i = 0; i < 4; ++i) {
    const std::endian order = i == 3 ? std::endian::big : std::endian::little;
    write_seed("cdr_" + target, std::to_string(i), tests::random_cdr(schema, stream.at(i), order));
  }
}

/// Colour and depth as image_transport packs them, and an organised cloud.
void write_packed_images(const RosHeader& header) {
  geometry::Image<std::uint16_t> codes(4, 3);
  const std::vector<std::uint16_t> values = {0, 0, 0, 1000, 1001, 999, 0, 65535, 1, 0, 0, 5};
  std::copy(values.begin(), values.end(), codes.data());
  const auto behind_header = [](std::vector<std::uint8_t> payload) {
    // Inverse depth with a = 10100, b = -1009.
    const std::vector<std::uint8_t> start = {0, 0, 0, 0, 0x00, 0xd0, 0x1d, 0x46, 0x00, 0x40, 0x7c, 0xc4};
    payload.insert(payload.begin(), start.begin(), start.end());
    return payload;
  };
  std::vector<std::uint8_t> rvl = {4, 0, 0, 0, 3, 0, 0, 0};
  const std::vector<std::uint8_t> code = tests::rvl_code(values);
  rvl.insert(rvl.end(), code.begin(), code.end());
  const auto png = encode_png(std::as_const(codes).view());
  const auto seed = [&](const std::string& name, const std::string& format, const std::vector<std::uint8_t>& data) {
    write_seed("cdr_compressed_image", name, encode_cdr(RosCompressedImage{header, format, data}));
  };
  for (const std::string encoding : {"16UC1", "32FC1"}) {
    seed(encoding + "_png", encoding + "; compressedDepth png", behind_header(png));
    seed(encoding + "_rvl", encoding + "; compressedDepth rvl", behind_header(rvl));
  }
  seed("depth_png", "16UC1; png compressed ", png);
  const geometry::ColorImage color(5, 4, {10, 20, 30});
  seed("jpeg", "rgb8; jpeg compressed bgr8", encode_jpeg(color.view()));
  seed("color_png", "rgb8; png compressed bgr8", encode_png(color.view()));
  std::vector<std::uint8_t> sized = {4, 3};
  sized.insert(sized.end(), code.begin(), code.end());
  write_seed("rvl", "published", sized);
  std::vector<std::uint8_t> empty = tests::rvl_words({200 * 100, 0});
  empty.insert(empty.begin(), {200, 100});
  write_seed("rvl", "empty", empty);

  RosPointCloud2 cloud{header, 8, 9, {{"x", 0, 7, 1}, {"y", 4, 7, 1}, {"z", 8, 7, 1}}, false, 12, 9 * 12, {}, false};
  for (int i = 0; i < 72; ++i) {
    const float point[3] = {0.1F * static_cast<float>(i % 9 - 4), 0.1F * static_cast<float>(i / 9 - 4), 0.8F};
    const auto* bytes = reinterpret_cast<const std::uint8_t*>(point);
    cloud.data.insert(cloud.data.end(), bytes, bytes + sizeof point);
  }
  write_seed("cdr_point_cloud", "organised", encode_cdr(cloud));
  cloud.fields[2].datatype = 8;
  write_seed("cdr_point_cloud", "beyond", encode_cdr(cloud));
}

void write_sound_messages() {
  const geometry::PinholeCamera camera{6, 4, 5.0, 5.0, 2.5, 1.5};
  const geometry::DepthImage depth(6, 4, 0.75F);
  const geometry::ColorImage color(6, 4, {1, 2, 3});
  const RosHeader header{{1, 2}, "camera"};
  write_seed("cdr_image", "16uc1", encode_cdr(to_ros_image_16uc1(depth, header)));
  write_seed("cdr_image", "32fc1", encode_cdr(to_ros_image_32fc1(depth, header)));
  write_seed("cdr_image", "rgb8", encode_cdr(to_ros_image(color, header)));
  // Colour of every form, with rows as short and images as small as they may be, and one step shorter.
  for (const auto& [encoding, bytes_per_pixel] : {std::pair{"bayer_rggb8", 1U},
                                                  {"bayer_grbg16", 2U},
                                                  {"uyvy", 2U},
                                                  {"yuv422_yuy2", 2U},
                                                  {"nv12", 1U},
                                                  {"nv21", 1U}}) {
    RosImage image = to_ros_image(color, header);
    image.encoding = encoding;
    image.step = image.width * bytes_per_pixel;
    image.data.resize(std::size_t{image.step} * 6);
    write_seed("cdr_image", encoding, encode_cdr(image));
    image.width = 5;
    image.height = 3;
    write_seed("cdr_image", std::string(encoding) + "_odd", encode_cdr(image));
    image.step = 5 * bytes_per_pixel - 1;
    write_seed("cdr_image", std::string(encoding) + "_short", encode_cdr(image));
  }
  write_packed_images(header);
  RosCameraInfo info = to_ros_camera_info(camera, header);
  write_seed("cdr_camera_info", "plain", encode_cdr(info));
  info.d = {-0.3, 0.1, 0.001, -0.002, 0.05};
  write_seed("cdr_camera_info", "plumb_bob", encode_cdr(info));
  info.distortion_model = "equidistant";
  info.d.pop_back();
  write_seed("cdr_camera_info", "equidistant", encode_cdr(info));
  const geometry::Pose X = geometry::Pose::from_translation({1, 2, 3});
  write_seed("cdr_tf", "plain", encode_cdr(RosTfMessage{{to_ros_transform(FrameTransform{"world", "camera", 5, X})}}));
  write_seed("cdr_pose_stamped", "plain", encode_cdr(RosPoseStamped{header, to_ros_pose(X)}));
  write_seed("cdr_pose_with_covariance", "plain",
             encode_cdr(RosPoseWithCovarianceStamped{header, to_ros_pose(X, 0.01 * geometry::Matrix6d::Identity())}));
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "usage: make_fuzz_seeds FOLDER\n");
    return 2;
  }
  corpus = argv[1];
  write_image_seeds();
  write_mesh_seeds();
  write_tree_file_seeds();
  write_tree_seeds();
  write_recording_seed("none", McapCompression::kNone, 600);
  write_recording_seed("lz4", McapCompression::kLz4, 1500);
  write_recording_seed("zstd", McapCompression::kZstd, 1500);
  write_message_seeds<RosImage>("image");
  write_message_seeds<RosCompressedImage>("compressed_image");
  write_message_seeds<RosPointCloud2>("point_cloud");
  write_message_seeds<RosCameraInfo>("camera_info");
  write_message_seeds<RosJointState>("joint_state");
  write_message_seeds<RosTfMessage>("tf");
  write_message_seeds<RosString>("string");
  write_message_seeds<RosClock>("clock");
  write_message_seeds<RosPoseStamped>("pose_stamped");
  write_message_seeds<RosPoseWithCovarianceStamped>("pose_with_covariance");
  write_message_seeds<RosPoseArray>("pose_array");
  write_message_seeds<RosTwistStamped>("twist");
  write_message_seeds<RosDetection3dArray>("detections");
  write_message_seeds<RosMarkerArray>("markers");
  write_message_seeds<RosDiagnosticArray>("diagnostics");
  write_sound_messages();
  write_frames_seeds();
  write_service_request_seeds();
  write_proposals_seeds();
  write_bag_metadata_seeds();
  return 0;
}
