// SPDX-License-Identifier: Apache-2.0
// The cameras of a scene file, and the noise of their depth.
#include <gmock/gmock.h>

#include <array>
#include <string>

#include "prescene/interfaces/scene_files/scene_file.h"
#include "tests/interfaces/scene_files/small_scene.h"

namespace prescene::interfaces {
namespace {

using belief::Scene;
using geometry::Vector3d;
using small_scene::error_of;
using small_scene::scene_of;
using small_scene::small;
using testing::AllOf;
using testing::HasSubstr;

TEST(SceneFile, ALookedAtPointIsInTheMiddleOfThePicture) {
  const Scene scene =
      scene_of(small("camera: {width: 320, height: 240, fov_deg: 90, look: {from: [1, 2, 3], at: [0, 0, 0.5]}}\n"));
  const belief::SceneCamera& camera = *scene.camera;
  const Vector3d p_C = camera.X_WC.inverse() * Vector3d(0, 0, 0.5);
  EXPECT_NEAR(p_C.x(), 0.0, 1e-12);
  EXPECT_NEAR(p_C.y(), 0.0, 1e-12);
  EXPECT_GT(p_C.z(), 0.0);
  const Vector3d above_C = camera.X_WC.inverse() * Vector3d(0, 0, 0.6);
  EXPECT_LT(above_C.y(), 0.0) << "up in the world is up in the picture, where y points down";
  EXPECT_NEAR(camera.intrinsics.fx, 160.0, 1e-9);
  EXPECT_EQ(camera.intrinsics.cx, 159.5);
}

TEST(SceneFile, ListsSeveralCameras) {
  const Scene scene = scene_of(small(R"(depth_noise: {incidence_knee: 0.4, sigma_per_depth_squared: 0.002}
cameras:
  - {name: front, fov_deg: 60, look: {from: [1, 0, 1], at: [0, 0, 0]}, depth_noise: {incidence_knee: 0.6}}
  - {name: wrist, fx: 600, preset: realsense, namespace: /wrist/camera, frame: wrist_optical}
  - name: side
    fx: 500
    topics: {depth: /side/points, camera_info: /side/info, depth_form: points}
    rectified: true
    pose: {position: [0, 1, 0.5]}
)"));
  ASSERT_EQ(belief::camera_count(scene), 3);
  const belief::SceneCamera& front = *belief::camera_at(scene, 0);
  EXPECT_EQ(&front, &*scene.camera);
  EXPECT_EQ(front.topics->depth, "/front/aligned_depth_to_color/image_raw") << "named after it";
  EXPECT_TRUE(front.is_placed);
  const belief::SceneCamera& wrist = *belief::camera_at(scene, 1);
  EXPECT_EQ(wrist.topics->color, "/wrist/camera/color/image_raw");
  EXPECT_EQ(wrist.frame, "wrist_optical");
  EXPECT_FALSE(wrist.is_placed) << "tf has to tell";
  const belief::SceneCamera& side = *belief::camera_at(scene, 2);
  EXPECT_EQ(side.topics->depth_form, "points");
  EXPECT_EQ(side.topics->color, "");
  EXPECT_EQ(side.topics->rectified, true);
  EXPECT_EQ(belief::camera_at(scene, 3), nullptr);
  EXPECT_EQ(belief::depth_noise_of(scene, 0).incidence_knee, 0.6);
  EXPECT_EQ(belief::depth_noise_of(scene, 0).sigma_per_depth_squared, 0.002);
  EXPECT_EQ(belief::depth_noise_of(scene, 1).incidence_knee, 0.4);
}

TEST(SceneFile, SaysWhatIsWrongWithCameras) {
  const auto error = [](const std::string& cameras) { return error_of(small("cameras:\n" + cameras)); };
  EXPECT_THAT(error("  - {name: a, fx: 500}\n  - {name: a, fx: 500, preset: zed}\n"),
              AllOf(HasSubstr("cameras[1].name: the name is taken on line"), HasSubstr("rename one")));
  EXPECT_THAT(error("  - {name: a, fx: 500, preset: zed}\n  - {name: b, fx: 500, preset: zed}\n"),
              AllOf(HasSubstr("cameras[1]: its topic /zed/zed_node/depth/depth_registered is named on line"),
                    HasSubstr("'namespace'")));
  EXPECT_THAT(error("  - {name: a, fx: 500, preset: kinect}\n"), HasSubstr("cameras[0].preset"));
  EXPECT_THAT(error("  - {name: a, fx: 500, namespace: /a}\n"), HasSubstr("it goes with 'preset'"));
  EXPECT_THAT(error("  - {name: a-b, fx: 500}\n"), HasSubstr("no topics can be named after 'a-b'"));
  EXPECT_THAT(error("  - {name: a, fx: 500, topics: {depth: depth, camera_info: /info}}\n"),
              HasSubstr("topics.depth: 'depth' is no name of a topic: give letters"));
  EXPECT_THAT(error("  - {name: a, fx: 500, topics: {depth: /d, camera_info: /d}}\n"), HasSubstr("topic /d is named"));
  EXPECT_THAT(error("  - {fx: 500}\n"), HasSubstr("name the camera"));
  EXPECT_THAT(error("  - {name: a}\n"), HasSubstr("fov_deg"));
  EXPECT_THAT(error("  {name: a, fx: 500}\n"), HasSubstr("give a list of cameras"));
  EXPECT_THAT(error("  - {name: a, fx: 500}\ncamera: {fx: 500, pose: {}}\n"),
              HasSubstr("'cameras' and 'camera' exclude each other"));
  EXPECT_EQ(error("  - {name: a, fx: 500}\n"), "");
}

TEST(SceneFile, ReadsTheDepthNoiseAndRefusesWhatNoCameraHas) {
  const auto noise =
      scene_of(small("depth_noise: {incidence_knee: 0.5, incidence_missing: [0.3, 0.2, 0]}\n")).depth_noise;
  EXPECT_EQ(noise.incidence_knee, 0.5);
  EXPECT_EQ(noise.incidence_missing, (std::array{0.3, 0.2, 0.0}));
  EXPECT_FALSE(noise.sigma_per_depth_squared || noise.outline_missing);
  const auto error = [](const std::string& keys) { return error_of(small("depth_noise: {" + keys + "}\n")); };
  EXPECT_THAT(error("sigma_per_depth_squared: 0"), HasSubstr("metres at 1 m"));
  EXPECT_THAT(error("sigma_per_depth_squared: 3.8"), HasSubstr("metres at 1 m"));
  EXPECT_THAT(error("incidence_knee: 1"), HasSubstr("a cosine"));
  EXPECT_THAT(error("incidence_missing: [0.1, 0.2]"), HasSubstr("depth_noise.incidence_missing"));
  EXPECT_THAT(error("outline_missing: [0.1, 0.2, 0.1, 1.0]"), HasSubstr("shares of pixels"));
  EXPECT_THAT(error("outline_mising: [0.1, 0.2, 0.1, 0.1]"), HasSubstr("did you mean 'outline_missing'"));
}

}  // namespace
}  // namespace prescene::interfaces
