// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/object_calibration.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "prescene/interfaces/scene_files/model_file.h"
#include "prescene/tests/support/simulated_motions.h"

namespace prescene::tests {
namespace {

using service::calibrate_object;
using service::MotionDataset;
using service::ObjectCalibration;
using service::read_motion_dataset;
using service::read_motion_table;
using simulation::CalibratedParameter;
using ::testing::HasSubstr;

class ObjectCalibrationTest : public ::testing::Test {
 protected:
  ObjectCalibrationTest()
      : folder_(std::filesystem::path(::testing::TempDir()) /
                (std::string("calibration_") + ::testing::UnitTest::GetInstance()->current_test_info()->name())),
        backends_(pool_, automatic()) {
    std::filesystem::create_directories(folder_);
  }
  ~ObjectCalibrationTest() override { std::filesystem::remove_all(folder_); }

  static service::BackendSettings automatic() {
    service::BackendSettings settings;
    settings.stepper = service::Stepper::kAutomatic;
    return settings;
  }
  void write(const std::string& name, const std::string& text) const { std::ofstream(folder_ / name) << text; }
  /// What the table's reader says.
  std::string refusal(const std::string& table) const {
    write("tosses.csv", table);
    const auto read = read_motion_table(folder_ / "tosses.csv");
    return read.ok() ? "accepted" : std::string(read.status().message());
  }

  std::filesystem::path folder_;
  core::ThreadPool pool_{1};
  service::Backends backends_;
};

TEST_F(ObjectCalibrationTest, FitsAModelThatScenesCanUse) {
  BoxTruth truth;
  truth.center_of_mass = {0.001, -0.001, 0.003};
  const belief::Scene scene = box_scene(truth);
  const auto simulator = backends_.make_simulator(scene);
  ASSERT_TRUE(simulator.ok());
  const auto motions = simulated_tosses(scene, **simulator, 16, core::RandomStream(1, core::Purpose::kTest), pool_);
  BoxTruth guess;
  guess.friction = 0.3;
  guess.impact_friction = 0.3;
  guess.restitution = 0.2;
  write("scene.yaml", box_scene_yaml(guess));
  write("tosses.csv", motion_table(motions));

  const auto dataset = read_motion_dataset(folder_, {});
  ASSERT_TRUE(dataset.ok()) << dataset.status().message();
  EXPECT_EQ(dataset->recordings.size(), 16U);
  service::ObjectCalibrationOptions options;
  options.samples = 8;
  options.max_evaluations = 200;
  options.keep = {"inertia_size", "edge_radius"};
  const auto found = calibrate_object(*dataset, backends_, options);
  ASSERT_TRUE(found.ok()) << found.status().message();
  EXPECT_EQ(found->flights, 16);
  ASSERT_TRUE(found->flight.has_value());
  const double truths[] = {0.22, 0.16, 0.3, 0.001, -0.001, 0.003};
  ASSERT_EQ(found->motion.parameters.size(), std::size(truths));
  for (std::size_t i = 0; i < std::size(truths); ++i) {
    const CalibratedParameter& p = found->motion.parameters[i];
    EXPECT_NEAR(p.value, truths[i], 4.0 * p.standard_error) << to_string(p.parameter);
    EXPECT_LT(p.left_of_prior, 0.5) << to_string(p.parameter);
  }
  const auto json = service::to_json(*found);
  EXPECT_EQ(json["parameters"].size(), std::size(truths));

  const auto yaml = calibrated_yaml(*dataset, *found, folder_);
  ASSERT_TRUE(yaml.ok()) << yaml.status().message();
  write("object.yaml", *yaml);
  const auto model = interfaces::read_model(folder_ / "object.yaml", "box");
  ASSERT_TRUE(model.ok()) << model.status().message() << "\n" << *yaml;
  EXPECT_EQ(model->collision, found->model.collision);
  EXPECT_EQ(model->contact, found->model.contact);
  EXPECT_EQ(model->center_of_mass, found->model.center_of_mass);
}

TEST_F(ObjectCalibrationTest, BadTablesAreRefusedByLine) {
  const std::string header = "toss,t,x,y,z,qw,qx,qy,qz\n";
  EXPECT_THAT(refusal(""), HasSubstr("line 1: there is no column 'toss'"));
  EXPECT_THAT(refusal("toss,t,x,y,z,qw,qx,qy\n"), HasSubstr("line 1: there is no column 'qz'"));
  EXPECT_THAT(refusal("toss,t,t,x,y,z,qw,qx,qy,qz\n"), HasSubstr("two columns 't'"));
  EXPECT_THAT(refusal(header), HasSubstr("no row with a pose"));
  EXPECT_THAT(refusal(header + "1,0,0,0,0,1,0,0\n"), HasSubstr("line 2: has 8 cells"));
  EXPECT_THAT(refusal(header + "1,0,0,nan,0,1,0,0,0\n"), HasSubstr("line 2: column 'y' holds 'nan'"));
  EXPECT_THAT(refusal(header + "1,0,0,,0,1,0,0,0\n"), HasSubstr("line 2: column 'y' holds ''"));
  EXPECT_THAT(refusal(header + "1,0,0,0,0,0.9,0,0,0\n"), HasSubstr("line 2: the quaternion's length is 0.9"));
  EXPECT_THAT(refusal(header + "1,0.1,0,0,0,1,0,0,0\n1,0.1,0,0,0,1,0,0,0\n"), HasSubstr("line 3: toss 1: its time"));
  EXPECT_THAT(refusal(header + "1,0,0,0,0,1,0,0,0\n2,0,0,0,0,1,0,0,0\n1,1,0,0,0,1,0,0,0\n"),
              HasSubstr("line 4: toss 1 stands in two places"));
  // Other columns, another order, carriage returns and an empty last line are fine.
  EXPECT_EQ(refusal("note,qz,qy,qx,qw,z,y,x,t,toss\r\nhello,0,0,0,1,0.3,0.2,0.1,0,a\r\n\r\n"), "accepted");
}

TEST_F(ObjectCalibrationTest, BadFoldersAreRefusedByFile) {
  const auto refused = [&] {
    const auto read = read_motion_dataset(folder_, {});
    return read.ok() ? std::string("accepted") : std::string(read.status().message());
  };
  EXPECT_THAT(refused(), HasSubstr("scene.yaml: there is no such file"));
  write("scene.yaml", box_scene_yaml({}));
  EXPECT_THAT(refused(), HasSubstr("tosses.csv: there is no such file"));
  write("tosses.csv", "toss,t,x,y,z,qw,qx,qy,qz\n1,0,0,0,0,1,0,0,0\n");
  EXPECT_EQ(refused(), "accepted");
  write("scene.yaml", box_scene_yaml({}) + "  second:\n    model: box\n    pose: {position: [1, 0, 0.3]}\n");
  EXPECT_THAT(refused(), HasSubstr("scene.yaml: it has 2 objects"));
  EXPECT_FALSE(read_motion_dataset(folder_ / "nowhere", {}).ok());
}

TEST_F(ObjectCalibrationTest, TooFewRecordingsSayHowManyItTakes) {
  write("scene.yaml", box_scene_yaml({}));
  const belief::Scene scene = box_scene({});
  const auto motions =
      simulated_tosses(scene, **backends_.make_simulator(scene), 6, core::RandomStream(1, core::Purpose::kTest), pool_);
  write("tosses.csv", motion_table(motions));
  const auto dataset = read_motion_dataset(folder_, {});
  ASSERT_TRUE(dataset.ok());
  const auto found = calibrate_object(*dataset, backends_, {});
  ASSERT_FALSE(found.ok());
  EXPECT_THAT(std::string(found.status().message()), HasSubstr("only 6 recordings; 8 parameters take at least 11"));
}

}  // namespace
}  // namespace prescene::tests
