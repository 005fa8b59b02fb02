// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/calibration/object_calibration.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "prescene/interfaces/scene_files/model_file.h"
#include "prescene/service/calibration/motion_units.h"
#include "tests/support/paths.h"
#include "tests/support/simulated_motions.h"

namespace prescene::tests {
namespace {

using service::calibrate_object;
using service::MotionDataset;
using service::ObjectCalibration;
using service::read_motion_dataset;
using service::read_motion_table;
using simulation::CalibratedParameter;
using ::testing::AllOf;
using ::testing::Contains;
using ::testing::HasSubstr;

class ObjectCalibrationTest : public ::testing::Test {
 protected:
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

  const ScratchDir scratch_;
  const std::filesystem::path folder_ = scratch_.path();
  core::ThreadPool pool_{1};
  service::Backends backends_{pool_, automatic()};
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

TEST_F(ObjectCalibrationTest, ExactFramesTellTheCentreAndAreRemarkedOn) {
  BoxTruth truth;
  truth.center_of_mass = {0.004, -0.003, 0.002};
  const belief::Scene scene = box_scene(truth);
  const auto simulator = backends_.make_simulator(scene);
  ASSERT_TRUE(simulator.ok());
  auto motions =
      simulated_tosses(scene, **simulator, 16, core::RandomStream(1, core::Purpose::kTest), pool_, {0.0, 0.0});
  // Every other frame: 60 Hz.
  for (SimulatedMotion& motion : motions) {
    for (std::size_t i = 0; 2 * i < motion.times.size(); ++i) {
      motion.times[i] = motion.times[2 * i];
      motion.X_WO[i] = motion.X_WO[2 * i];
    }
    motion.times.resize((motion.times.size() + 1) / 2);
    motion.X_WO.resize((motion.X_WO.size() + 1) / 2);
  }
  write("scene.yaml", box_scene_yaml({}));
  write("tosses.csv", motion_table(motions));
  const auto dataset = read_motion_dataset(folder_, {});
  ASSERT_TRUE(dataset.ok()) << dataset.status().message();
  service::ObjectCalibrationOptions options;
  options.samples = 8;
  options.max_evaluations = 100;
  options.keep = {"inertia_size", "edge_radius", "friction"};
  const auto found = calibrate_object(*dataset, backends_, options);
  ASSERT_TRUE(found.ok()) << found.status().message();
  for (int i = 0; i < 3; ++i) {
    const CalibratedParameter& center = found->motion.parameters[static_cast<std::size_t>(2 + i)];
    EXPECT_NEAR(center.value, truth.center_of_mass[i], 4.0 * center.standard_error) << to_string(center.parameter);
    EXPECT_GE(center.standard_error, 1e-5);
    EXPECT_LT(center.standard_error, 1e-4);
  }
  EXPECT_THAT(found->remarks, Contains(HasSubstr("next to no noise")));
  EXPECT_THAT(found->remarks, Contains(HasSubstr("60 frames a second")));
}

TEST_F(ObjectCalibrationTest, SaysThatAFitIsPoor) {
  const belief::Scene scene = box_scene({});
  auto motions = simulated_tosses(scene, **backends_.make_simulator(scene), 12,
                                  core::RandomStream(1, core::Purpose::kTest), pool_);
  // Something else touches it: after the first contact it drifts to a side of its own.
  core::RandomStream stream(2, core::Purpose::kTest);
  for (SimulatedMotion& motion : motions) {
    const double y = stream.normal(), x = stream.normal();
    const geometry::Vector3d drift(x, y, 0.0);
    for (std::size_t i = 0; i < motion.times.size(); ++i)
      motion.X_WO[i].translation += std::max(0.0, motion.times[i] - motion.first_contact) * drift;
  }
  write("scene.yaml", box_scene_yaml({}));
  write("tosses.csv", motion_table(motions));
  const auto dataset = read_motion_dataset(folder_, {});
  ASSERT_TRUE(dataset.ok());
  service::ObjectCalibrationOptions options;
  options.samples = 8;
  options.max_evaluations = 100;
  options.keep = {"inertia_size", "edge_radius", "center_of_mass_x", "center_of_mass_y", "center_of_mass_z"};
  const auto found = calibrate_object(*dataset, backends_, options);
  ASSERT_TRUE(found.ok()) << found.status().message();
  EXPECT_GT(found->motion.start_noise, 10.0);
  EXPECT_THAT(found->remarks, Contains(HasSubstr("the fit is poor")));
}

TEST_F(ObjectCalibrationTest, OneBadTossIsLeftOutAndNamed) {
  const belief::Scene scene = box_scene({});
  const auto simulator = backends_.make_simulator(scene);
  auto slides = simulated_slides(scene, **simulator, 8, core::RandomStream(1, core::Purpose::kTest), pool_);
  for (geometry::Pose& pose : slides[3].X_WO) pose.translation.z() += 0.04;
  write("scene.yaml", box_scene_yaml({}));
  service::ObjectCalibrationOptions options;
  options.samples = 4;
  options.max_evaluations = 30;
  options.keep = {"impact_friction",  "restitution",      "inertia_size",    "edge_radius",
                  "center_of_mass_x", "center_of_mass_y", "center_of_mass_z"};
  const auto fitted = [&](const std::vector<SimulatedMotion>& motions) {
    write("tosses.csv", motion_table(motions));
    return calibrate_object(*read_motion_dataset(folder_, {}), backends_, options);
  };
  const auto found = fitted(slides);
  ASSERT_TRUE(found.ok()) << found.status().message();
  EXPECT_EQ(found->slides, 7);
  EXPECT_THAT(found->remarks, Contains(AllOf(HasSubstr("left out: toss 3: "), HasSubstr("mm above a support"))));
  // Of most of them it is the scene that is wrong.
  for (std::size_t i : {0U, 1U, 2U, 4U})
    for (geometry::Pose& pose : slides[i].X_WO) pose.translation.z() += 0.04;
  const auto refused = fitted(slides);
  ASSERT_FALSE(refused.ok());
  EXPECT_THAT(std::string(refused.status().message()),
              AllOf(HasSubstr("tosses.csv: 5 of 8 recordings can't be used: toss 0: "), HasSubstr("toss 1: "),
                    HasSubstr("mm above a support")));
}

TEST_F(ObjectCalibrationTest, FeetAreToldByHowTossesFall) {
  const belief::Scene scene = box_scene({});
  const auto simulator = backends_.make_simulator(scene);
  auto motions = simulated_tosses(scene, **simulator, 12, core::RandomStream(1, core::Purpose::kTest), pool_);
  for (SimulatedMotion& motion : motions)
    for (geometry::Pose& pose : motion.X_WO) pose.translation /= 0.3048;
  write("scene.yaml", box_scene_yaml({}));
  write("tosses.csv", motion_table(motions));
  const auto found = calibrate_object(*read_motion_dataset(folder_, {}), backends_, {});
  ASSERT_FALSE(found.ok());
  EXPECT_THAT(std::string(found.status().message()),
              AllOf(HasSubstr("tosses.csv: flights fall with 3"), HasSubstr("in feet multiply them by 0.3048")));
}

TEST_F(ObjectCalibrationTest, SaysThatAHandStillPushes) {
  std::vector<SimulatedMotion> motions(8);
  core::RandomStream stream(3, core::Purpose::kTest);
  const double height = geometry::bounding_box(belief::collision_mesh(box_scene({}).models[0])).sizes().z() / 2.0;
  for (SimulatedMotion& motion : motions) {
    const double speed = stream.uniform(0.2, 0.4);
    for (int i = 0; i < 120; ++i) {
      const double t = i / 120.0;
      const auto noise = [&] { return 2e-4 * stream.normal(); };
      motion.times.push_back(t);
      motion.X_WO.push_back(
          geometry::Pose::from_translation({speed * t + noise(), noise(), height - 3e-4 + 0.3 * noise()}));
    }
  }
  write("scene.yaml", box_scene_yaml({}));
  write("tosses.csv", motion_table(motions));
  const auto dataset = read_motion_dataset(folder_, {});
  ASSERT_TRUE(dataset.ok()) << dataset.status().message();
  service::ObjectCalibrationOptions options;
  options.samples = 8;
  options.max_evaluations = 100;
  options.keep = {"impact_friction",  "restitution",      "inertia_size",    "edge_radius",
                  "center_of_mass_x", "center_of_mass_y", "center_of_mass_z"};
  const auto found = calibrate_object(*dataset, backends_, options);
  ASSERT_TRUE(found.ok()) << found.status().message();
  EXPECT_THAT(found->remarks, Contains(HasSubstr("a hand that still pushes it")));
}

TEST_F(ObjectCalibrationTest, OtherUnitsAreRefusedWithTheirRemedy) {
  const belief::Scene scene = box_scene({});
  write("scene.yaml", box_scene_yaml({}));
  const auto refusal_of = [&](std::vector<SimulatedMotion> motions, double lengths, double times) {
    for (SimulatedMotion& motion : motions) {
      for (double& time : motion.times) time *= times;
      for (geometry::Pose& pose : motion.X_WO) pose.translation *= lengths;
    }
    write("tosses.csv", motion_table(motions));
    const auto dataset = read_motion_dataset(folder_, {});
    if (!dataset.ok()) return std::string(dataset.status().message());
    const auto found = calibrate_object(*dataset, backends_, {});
    return found.ok() ? std::string("accepted") : std::string(found.status().message());
  };
  const auto simulator = backends_.make_simulator(scene);
  const auto tosses = simulated_tosses(scene, **simulator, 12, core::RandomStream(1, core::Purpose::kTest), pool_);
  const auto slides = simulated_slides(scene, **simulator, 12, core::RandomStream(1, core::Purpose::kTest), pool_);
  for (const auto& motions : {tosses, slides}) {
    const std::string millimetres = refusal_of(motions, 1000.0, 1.0);
    EXPECT_THAT(millimetres, HasSubstr("tosses.csv: "));
    EXPECT_THAT(millimetres, HasSubstr("in millimetres divide them by 1000"));
    EXPECT_THAT(refusal_of(motions, 1.0, 1000.0), HasSubstr("t must be in seconds"));
  }
  EXPECT_THAT(refusal_of(tosses, 100.0, 1.0), HasSubstr("centimetres"));
}

TEST(MotionUnits, OneRecordingThatRunsAwayRefusesNoDataSet) {
  std::vector<service::MotionRecording> recordings(3);
  for (int i = 0; i < 20; ++i) {
    const double t = 0.01 * i;
    for (std::size_t k = 0; k < 3; ++k) {
      const double speed = k == 0 ? 1e4 : 2.0;
      recordings[k].frames.push_back({t, geometry::Pose::from_translation({speed * t, 0.0, -4.9 * t * t})});
    }
  }
  EXPECT_NEAR(service::frame_rate(recordings), 100.0, 1e-6);
  EXPECT_TRUE(service::check_units(recordings, 9.81).ok());
  recordings[1] = recordings[0];
  EXPECT_EQ(service::check_units(recordings, 9.81).code(), core::StatusCode::kInvalidInput);
  EXPECT_EQ(service::frame_rate({}), 0.0);
  EXPECT_TRUE(service::check_units({}, 9.81).ok());
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
  EXPECT_THAT(refusal("toss;t;x;y;z;qw;qx;qy;qz\n1;0;0;0;0;1;0;0;0\n"),
              HasSubstr("line 1: its cells are separated by semicolons; separate them by commas"));
  EXPECT_THAT(refusal("toss\tt\tx\ty\tz\tqw\tqx\tqy\tqz\n"), HasSubstr("separated by tabs"));
  // Spreadsheets put a byte order mark first.
  EXPECT_EQ(refusal("\xEF\xBB\xBF" + header + "1,0,0,0,0,1,0,0,0\n"), "accepted");
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

TEST_F(ObjectCalibrationTest, TwinsOfOneMotionAreNotEnough) {
  write("scene.yaml", box_scene_yaml({}));
  const belief::Scene scene = box_scene({});
  const auto one =
      simulated_tosses(scene, **backends_.make_simulator(scene), 1, core::RandomStream(1, core::Purpose::kTest), pool_);
  std::vector<SimulatedMotion> motions;
  for (int i = 0; i < 12; ++i) {
    motions.push_back(one[0]);
    const geometry::Pose X{geometry::exp_rotation({0.0, 0.0, 0.5 * i}), geometry::Vector3d(0.03 * i, -0.01 * i, 0.0)};
    for (geometry::Pose& X_WO : motions.back().X_WO) X_WO = X * X_WO;
  }
  write("tosses.csv", motion_table(motions));
  const auto dataset = read_motion_dataset(folder_, {});
  ASSERT_TRUE(dataset.ok()) << dataset.status().message();
  const auto found = calibrate_object(*dataset, backends_, {});
  ASSERT_FALSE(found.ok());
  EXPECT_EQ(found.status().code(), core::StatusCode::kInvalidInput);
  EXPECT_THAT(std::string(found.status().message()),
              AllOf(HasSubstr("tosses.csv: only 1 of 12 recordings"), HasSubstr("twins"),
                    HasSubstr("it takes at least 11: record more")));
}

}  // namespace
}  // namespace prescene::tests
