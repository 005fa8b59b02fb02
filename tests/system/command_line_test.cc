// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>

#include "prescene/geometry/primitives.h"
#include "prescene/interfaces/images/png.h"
#include "prescene/interfaces/mesh_files/mesh_file.h"
#include "program.h"
#include "tests/support/paths.h"

namespace prescene::tests {
namespace {

using nlohmann::ordered_json;

std::string scenario(const std::string& name) { return (source_dir() / "scenarios" / (name + ".yaml")).string(); }

ordered_json parsed(const Finished& finished) {
  ordered_json json = ordered_json::parse(finished.out, nullptr, false);
  EXPECT_FALSE(json.is_discarded()) << "stdout is not one JSON document:\n"
                                    << finished.out << "\nstderr:\n"
                                    << finished.err;
  return json;
}

TEST(CommandLine, HelpIsThereForTheProgramAndEachVerb) {
  EXPECT_EQ(run_program({"--help"}).exit_code, 0);
  EXPECT_EQ(run_program({"--version"}).exit_code, 0);
  for (const char* verb : {"validate", "predict", "inspect", "doctor", "record", "replay", "explain", "serve", "ask",
                           "achieve", "view", "train", "demo", "evaluate", "calibrate"}) {
    const Finished help = run_program({verb, "--help"});
    EXPECT_EQ(help.exit_code, 0) << verb;
    EXPECT_NE(help.out.find("--json"), std::string::npos) << verb;
    EXPECT_NE(help.out.find("--seed"), std::string::npos) << verb;
  }
}

TEST(CommandLine, BadArgumentsEndWithTwo) {
  for (const std::vector<std::string>& args :
       std::vector<std::vector<std::string>>{{},
                                             {"nonsense"},
                                             {"predict"},
                                             {"predict", "a", "--tolerance", "2"},
                                             {"predict", scenario("milk_on_bin"), "--threads", "-3"},
                                             {"predict", scenario("milk_on_bin"), "--seed", "-1"},
                                             {"predict", scenario("milk_on_bin"), "--seed", "18446744073709551616"},
                                             {"predict", scenario("milk_on_bin"), "--duration", "nan"},
                                             {"predict", scenario("milk_on_bin"), "--duration", "inf"},
                                             {"predict", scenario("milk_on_bin"), "--tolerance", "nan"},
                                             {"record"},
                                             {"evaluate", "nothing", "--data", "."},
                                             {"calibrate", "cube_tosses"},
                                             {"train", scenario("milk_on_bin")},
                                             {"train", scenario("milk_on_bin"), "-o", "p.bin", "--views", "0"},
                                             {"evaluate", "tracking", "--proposals", "p.bin"},
                                             {"explain", "none.mcap", "--from", "1"},
                                             {"explain", "none.mcap", "--from", "2", "--to", "1"},
                                             {"explain", "none.mcap", "--from", "-1", "--to", "1"},
                                             {"explain", "none.mcap", "--from", "1", "--to", "2", "--wanted", "{"},
                                             {"ask", "explain", "--scene", scenario("milk_on_bin")},
                                             {"ask", "why", "--timeout", "0.1"},
                                             {"ask", "why", "mug", "--scene", scenario("milk_on_bin")},
                                             {"ask", "why", "mug", "--against", "1,2,3"},
                                             {"ask", "why", "mug", "--look-at", "0,0,0"},
                                             {"ask", "where", "mug", "--against", "absence"},
                                             {"ask", "explain", "--last", "0"},
                                             {"ask", "where", "--last", "2"},
                                             {"ask", "where", "--images", "x"},
                                             {"ask", "view", "--look-from", "0,0,1"},
                                             {"ask", "view", "--look-from", "0,0", "--look-at", "0,0,0"},
                                             {"ask", "view", "--look-from", "0,0,1", "--look-at", "0,0,1"},
                                             {"ask", "next_view", "mug"},
                                             {"ask", "next_view", "--look-from", "0,0,1", "--look-at", "0,0,0"},
                                             {"serve", "--scene", "x", "--domain", "999"}}) {
    const Finished finished = run_program(args);
    EXPECT_EQ(finished.exit_code, 2) << finished.err;
    EXPECT_FALSE(finished.err.empty());
    EXPECT_TRUE(finished.out.empty()) << finished.out;
  }
}

TEST(CommandLine, AMistypedVerbIsNamedWithTheNearest) {
  const Finished finished = run_program({"inspec", "cup.ply"});
  EXPECT_EQ(finished.exit_code, 2);
  EXPECT_NE(finished.err.find("'inspec': did you mean 'inspect'?"), std::string::npos) << finished.err;
}

TEST(CommandLine, AMistypedOptionIsNamedWithTheNearest) {
  for (const auto& [args, said] : std::vector<std::pair<std::vector<std::string>, std::string>>{
           {{"predict", scenario("milk_on_bin"), "--tolerence", "0.1"},
            "there is no option '--tolerence': did you mean '--tolerance'?"},
           {{"predict", scenario("milk_on_bin"), "--sed=3"}, "there is no option '--sed': did you mean '--seed'?"},
           // Also where something else is missing because of it.
           {{"record", "--outptu", "x.mcap"}, "there is no option '--outptu': did you mean '--output'?"},
           {{"serve", "--scene", "x", "--depth-topics", "/d"}, "did you mean '--depth-topic'?"},
           {{"--versoin"}, "did you mean '--version'?"},
           {{"replay", "x.mcap", "--weather-forecast"}, "there is no option '--weather-forecast'\n"}}) {
    const Finished finished = run_program(args);
    EXPECT_EQ(finished.exit_code, 2) << args[0];
    EXPECT_NE(finished.err.find(said), std::string::npos) << finished.err;
    std::vector<std::string> with_json = args;
    with_json.push_back("--json");
    EXPECT_NE(run_program(with_json).out.find("there is no option"), std::string::npos) << args[0];
  }
}

TEST(CommandLine, AMistypedWordOfAnOptionIsNamedWithTheNearest) {
  const Finished finished = run_program({"predict", scenario("milk_on_bin"), "--stepper", "lockstp"});
  EXPECT_EQ(finished.exit_code, 2);
  EXPECT_NE(finished.err.find("--stepper: 'lockstp' is not known here: did you mean 'lockstep'?"), std::string::npos)
      << finished.err;
}

TEST(CommandLine, WhatWouldHaveNoEffectIsRefused) {
  const std::string scene = scenario("milk_on_bin");
  for (const auto& [args, said] : std::vector<std::pair<std::vector<std::string>, std::string>>{
           {{"predict", scene, "--heat-map", "map.jpg"}, "--heat-map map.jpg: the picture is written as PNG"},
           {{"achieve", scene, "--outcome", "in_bin", "--free", "position", "--map", "map.svg"}, "is written as PNG"},
           {{"achieve", scene, "--outcome", "in_bin", "--free", "position", "--delay", "0.1"},
            "errors.delay: that is of"},
           {{"explain", "r.mcap", "--from", "0", "--to", "1", "--frame-rate", "3"}, "--frame-rate is for folders"},
           {{"inspect", "r.mcap", "--depth-scale", "0.5"}, "--depth-scale is for folders"},
           {{"evaluate", "finding", "--split", "all"}, "--split is for cube_tosses, not for finding"},
           {{"inspect", "cup.ply", "--use", "spheres"}, "--use is written into the model file"},
           {{"inspect", "cup.ply", "--depth-topic", "/d"}, "--depth-topic is for recordings"},
           {{"inspect", "r.mcap", "--depth-noise", "--depth-topic", "/d"}, "does not go with --depth-noise"},
           {{"doctor", "--rectified", "--not-rectified"}, "--rectified: it is given together with its opposite"},
           {{"serve", "--scene", scene, "--new-objects", "--no-new-objects"}, "together with its opposite"}}) {
    const Finished finished = run_program(args);
    EXPECT_EQ(finished.exit_code, 2) << args[0] << finished.err;
    EXPECT_NE(finished.err.find(said), std::string::npos) << finished.err;
  }
}

TEST(CommandLine, ValidateListsEachMistakeByItself) {
  const ScratchDir folder;
  const std::string scene = (folder.path() / "wrong.yaml").string();
  write_file(scene,
             "models:\n  a: {box: [0.1, 0.1, 0.1], mass: 1, mass: 2, fricton: 1}\n"
             "objects:\n  a: {model: b, pose: {position: [0, 0, 0]}}\n");
  const Finished finished = run_program({"validate", scene, "--json"});
  EXPECT_EQ(finished.exit_code, 2);
  EXPECT_TRUE(parsed(finished)["files"][0]["warnings"].is_array());
  const auto errors = parsed(finished)["files"][0]["errors"];
  ASSERT_EQ(errors.size(), 3u) << finished.out;
  for (std::size_t i = 0; i < errors.size(); ++i) {
    EXPECT_EQ(errors[i]["file"], scene);
    EXPECT_FALSE(errors[i]["remedy"].get<std::string>().empty());
  }
  std::string all;
  for (const auto& error : errors)
    all += std::to_string(error["line"].get<int>()) + " " + error["message"].get<std::string>() + "\n";
  EXPECT_NE(all.find("2 the key 'mass' is here twice"), std::string::npos) << all;
  EXPECT_NE(all.find("2 models.a.fricton: unknown key"), std::string::npos) << all;
  EXPECT_NE(all.find("4 objects.a.model: 'b' is not a model"), std::string::npos) << all;
}

TEST(CommandLine, OnlyValidateSaysHowEachMeshWasTidiedUp) {
  const ScratchDir folder;
  // A tetrahedron with one corner twice.
  write_file((folder.path() / "wedge.obj").string(),
             "v 0 0 0\nv 0.1 0 0\nv 0 0.1 0\nv 0 0 0.1\nv 0 0 0\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 5 4\n");
  const std::string scene = (folder.path() / "scene.yaml").string();
  write_file(scene,
             "models:\n  wedge: {mesh: {file: wedge.obj}, mass: 0.1}\nsupports:\n  floor: {ground: {size: 2}}\n"
             "objects:\n  wedge: {model: wedge, pose: {position: [0, 0, 0.01]}}\n");
  const Finished checked = run_program({"validate", scene});
  EXPECT_NE(checked.err.find("wedge.obj: 1 vertices at the same place made one"), std::string::npos) << checked.err;
  EXPECT_NE(checked.out.find("1 warning"), std::string::npos) << checked.out;
  const Finished predicted = run_program({"predict", scene, "--max-instances", "16"});
  EXPECT_EQ(predicted.exit_code, 0) << predicted.err;
  EXPECT_NE(predicted.err.find("1 mesh has triangles or vertices that were tidied up"), std::string::npos)
      << predicted.err;
  EXPECT_EQ(predicted.err.find("made one"), std::string::npos) << predicted.err;
}

TEST(CommandLine, ProgressFitsTheTerminal) {
  for (const int columns : {24, 60, 80, 200}) {
    const std::string seen =
        run_program_in_terminal({"predict", scenario("milk_on_bin"), "--max-instances", "600"}, columns);
    EXPECT_NE(seen.find("%"), std::string::npos) << seen;
    // Each line of progress begins anew at the left.
    std::size_t begin = seen.find("\r\033[K");
    ASSERT_NE(begin, std::string::npos) << seen;
    while (begin != std::string::npos) {
      begin += 4;
      const std::size_t end = seen.find('\r', begin);
      const std::string line = seen.substr(begin, end - begin);
      EXPECT_LT(line.size(), static_cast<std::size_t>(columns)) << line;
      begin = seen.find("\r\033[K", begin);
    }
  }
  const Finished piped = run_program({"predict", scenario("milk_on_bin"), "--max-instances", "600"});
  std::istringstream lines(piped.err);
  for (std::string line; std::getline(lines, line);) EXPECT_LT(line.size(), 80U) << line;
}

TEST(CommandLine, MissingFilesAreNamed) {
  for (const std::vector<std::string>& args :
       std::vector<std::vector<std::string>>{{"predict", "no/such.yaml"},
                                             {"inspect", "no/such.ply"},
                                             {"replay", "no/such.mcap"},
                                             {"evaluate", "ycb_video", "--data", "no/such"},
                                             {"calibrate", "cube_tosses", "--data", "no/such"}}) {
    const Finished finished = run_program(args);
    EXPECT_EQ(finished.exit_code, 2) << args[0];
    EXPECT_NE(finished.err.find("no/such"), std::string::npos) << finished.err;
  }
}

TEST(CommandLine, WithJsonAFailureIsOneDocumentToo) {
  for (const std::vector<std::string>& args :
       std::vector<std::vector<std::string>>{{"predict", "no/such.yaml", "--json"},
                                             {"predict", "--json"},
                                             {"inspect", "no/such.ply", "--json"},
                                             {"replay", "no/such.mcap", "--json"},
                                             {"ask", "--json", "--question", "{"},
                                             {"validate", "no/such.yaml", "--json"}}) {
    const Finished finished = run_program(args);
    EXPECT_EQ(finished.exit_code, 2) << args[0];
    const ordered_json json = parsed(finished);
    EXPECT_TRUE(json.contains("error") || json.contains("files")) << finished.out;
    EXPECT_FALSE(finished.err.empty());
  }
}

// Straight down on the ground from 2 m: 2000 mm, everywhere the same but for the box in the middle, 1900 mm.
TEST(CommandLine, AsksForTheViewFromAPointAndWritesItsImages) {
  const ScratchDir scratch;
  const std::filesystem::path folder = scratch.path() / "seen";
  const std::string scene = (scratch.path() / "box.yaml").string();
  write_file(scene,
             "name: box\nduration: 0.2\nmodels:\n  box: {box: [0.1, 0.1, 0.1], mass: 0.4}\n"
             "supports:\n  floor: {ground: {size: 8}}\n"
             "objects:\n  box: {model: box, pose: {position: [0, 0, 0.05]}}\n");
  const Finished asked = run_program({"ask", "--scene", scene, "--question",
                                      R"({"view": {"time": 0, "compact": true, "detail": ["spread"],
      "pose": {"position": [0, 0, 2], "rotation": {"quaternion_wxyz": [0, 1, 0, 0]}},
      "intrinsics": {"width": 41, "height": 31, "fx": 40}}})",
                                      "--images", folder.string()});
  ASSERT_EQ(asked.exit_code, 0) << asked.err;
  const auto depth = interfaces::read_png_depth(folder / "mean_depth.png", 0.001);
  ASSERT_TRUE(depth) << core::to_string(depth.status());
  EXPECT_NEAR((*depth)(20, 15), 1.9, 1e-6);
  EXPECT_NEAR((*depth)(2, 2), 2.0, 1e-6);
  const auto deviation = interfaces::read_png_depth(folder / "depth_deviation.png", 0.0001);
  ASSERT_TRUE(deviation) << core::to_string(deviation.status());
  EXPECT_EQ((*deviation)(20, 15), 0.0F);
}

TEST(CommandLine, OutputThatCannotBeWrittenIsAFailure) {
  if (!std::filesystem::exists("/dev/full")) GTEST_SKIP() << "this system has no /dev/full";
  EXPECT_EQ(run_program_writing_to("/dev/full", {"validate", scenario("milk_on_bin")}), 1);
  EXPECT_EQ(run_program_writing_to("/dev/full", {"validate", scenario("milk_on_bin"), "--json"}), 1);
  EXPECT_EQ(run_program_writing_to("/dev/full", {"--help"}), 1);
}

constexpr const char* kOneBox =
    "name: box\nduration: 0.2\nmodels:\n  box: {box: [0.1, 0.1, 0.1], mass: 0.4}\n"
    "supports:\n  floor: {ground: {size: 4}}\n"
    "objects:\n  box: {model: box, pose: {position: [{normal: [0, 0.01]}, 0, 0.05]}}\n"
    "outcomes:\n  low: {object: box, below: 0.2}\n";

TEST(CommandLine, InputThatCannotBeUsedEndsWithTwo) {
  const ScratchDir folder;
  const auto file = [&](const std::string& name) { return (folder.path() / name).string(); };
  write_file(file("large.yaml"), "# " + std::string(20u << 20, 'x') + "\n");
  write_file(file("bad.yaml"), "name: [\n");
  write_file(file("bad.ply"), "ply\nnonsense\n");
  write_file(file("bad.mcap"), "nonsense");
  std::filesystem::create_directory(file("folder.yaml"));
  for (const std::vector<std::string>& args :
       std::vector<std::vector<std::string>>{{"validate", file("none.yaml")},
                                             {"validate", file("large.yaml")},
                                             {"validate", file("bad.yaml")},
                                             {"validate", file("folder.yaml")},
                                             {"validate", file("bad.yaml/x.yaml")},
                                             {"predict", file("none.yaml")},
                                             {"predict", file("large.yaml")},
                                             {"predict", file("bad.yaml")},
                                             {"inspect", file("none.ply")},
                                             {"inspect", file("bad.ply")},
                                             {"replay", file("none.mcap")},
                                             {"replay", file("bad.mcap")},
                                             {"record", "--simulate", file("large.yaml"), "-o", file("r.mcap")},
                                             {"serve", "--scene", file("large.yaml")},
                                             {"ask", "--question", "{"},
                                             {"evaluate", "cube_tosses", "--data", file("none")},
                                             {"calibrate", file("none"), "-o", file("o.yaml")},
                                             {"train", file("none.yaml"), "-o", file("p.bin")},
                                             {"train", file("bad.yaml"), "-o", file("p.bin")},
                                             {"evaluate", "finding", "--proposals", file("bad.ply")}}) {
    const Finished finished = run_program(args, {own_bus()});
    EXPECT_EQ(finished.exit_code, 2) << args[0] << " " << args[1] << ": " << finished.err;
    EXPECT_NE(finished.err.find("prescene " + args[0]), std::string::npos) << finished.err;
  }
}

TEST(CommandLine, DoctorSaysWhatIsMissingAndEndsWithOne) {
  const ScratchDir folder;
  const std::string scene = (folder.path() / "box.yaml").string();
  write_file(scene, kOneBox);
  const Finished finished = run_program(
      {"doctor", scene, "--seconds", "0.5", "--camera", "zed", "--color-topic", "/mine", "--json"}, {own_bus()});
  EXPECT_EQ(finished.exit_code, 1) << finished.err;
  EXPECT_NE(finished.err.find("depth /zed/zed_node/depth/depth_registered, colour /mine,"), std::string::npos)
      << "what is named by itself takes precedence: " << finished.err;
  const auto document = nlohmann::json::parse(finished.out, nullptr, false);
  ASSERT_FALSE(document.is_discarded()) << finished.out;
  EXPECT_EQ(document["usable"], false);
  std::map<std::string, nlohmann::json> checks;
  for (const auto& check : document["checks"]) {
    checks[check["check"].get<std::string>()] = check;
    EXPECT_EQ(check["status"] == "ok", check["remedy"] == "") << check;
  }
  EXPECT_EQ(checks["scene"]["status"], "ok");
  EXPECT_EQ(checks["depth image"]["status"], "error");

  write_file(scene, "name: [1\n");
  const Finished wrong = run_program({"doctor", scene, "--seconds", "0.5"}, {own_bus()});
  EXPECT_EQ(wrong.exit_code, 1);
  EXPECT_NE(wrong.out.find("box.yaml:"), std::string::npos) << wrong.out;
  for (const std::vector<std::string>& args :
       std::vector<std::vector<std::string>>{{"doctor", (folder.path() / "none.yaml").string()},
                                             {"doctor", "--seconds", "0"},
                                             {"doctor", "--camera", "kinect"},
                                             {"doctor", "--depth-form", "png"},
                                             {"doctor", "--overlay", "seen.png"},
                                             {"doctor", "--depth-topic", "/a", "--camera-info-topic", "/a"}}) {
    const Finished refused = run_program(args, {own_bus()});
    EXPECT_EQ(refused.exit_code, 2) << args[1] << ": " << refused.err;
  }
}

TEST(CommandLine, OutputThatCannotBeWrittenEndsWithOneAndIsNamed) {
  const ScratchDir folder;
  const auto file = [&](const std::string& name) { return (folder.path() / name).string(); };
  write_file(file("box.yaml"), kOneBox);
  write_file(file("box.ply"),
             "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
             "element face 4\nproperty list uchar int vertex_indices\nend_header\n"
             "0 0 0\n0.1 0 0\n0 0.1 0\n0 0 0.1\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n");
  for (const std::string& out : {file("no/such"), std::string("/proc/out")}) {
    for (const std::vector<std::string>& args :
         std::vector<std::vector<std::string>>{{"predict", file("box.yaml"), "--heat-map", out + ".png"},
                                               {"predict", file("box.yaml"), "--report", out + ".html"},
                                               {"inspect", file("box.ply"), "-o", out + ".yaml"},
                                               {"inspect", file("box.ply"), "--report", out + ".html"},
                                               {"record", "-o", out + ".mcap"},
                                               {"serve", "--scene", file("box.yaml"), "--record", out + ".mcap"}}) {
      const Finished finished = run_program(args, {own_bus()});
      EXPECT_EQ(finished.exit_code, 1) << args[0] << " " << args[2] << ": " << finished.err;
      EXPECT_NE(finished.err.find(args.back() + ": "), std::string::npos) << finished.err;
      EXPECT_EQ(finished.err.find(".partial"), std::string::npos) << finished.err;
      EXPECT_EQ(finished.out, "");
      if (out == file("no/such")) {
        EXPECT_EQ(finished.err.find("predicting"), std::string::npos) << "in vain: " << finished.err;
      }
    }
  }
}

TEST(CommandLine, PredictRefusesWhatMeansNothingAndSaysWhatWould) {
  const ScratchDir folder;
  const std::string scene = (folder.path() / "box.yaml").string();
  write_file(scene, kOneBox);
  const auto refused = [&](std::vector<std::string> more, const std::string& remedy) {
    more.insert(more.begin(), {"predict", scene});
    const Finished finished = run_program(more);
    EXPECT_EQ(finished.exit_code, 2) << finished.err;
    EXPECT_NE(finished.err.find(remedy), std::string::npos) << finished.err;
  };
  refused({"--outcomes-only"}, "leave it out");
  refused({"--outcomes-only", "--json", "--report", (folder.path() / "r.html").string()}, "leave it out");
  refused({"--duration", "1e-12"}, "at least one step of the simulator, 0.00");
  refused({"--max-instances", "0"}, "1");
  refused({"--budget", "1e9"}, "up to 1000000 s");
  refused({"--confidence", "0.9999999999999999"}, "between 0.5 and 0.9999");
  refused({"--duration", "3601"}, "up to 3600");
  EXPECT_EQ(run_program({"predict", scenario("drawer_pulled"), "--stepper", "lockstep"}).exit_code, 2);
  const std::vector<std::string> few = {"predict", scenario("drawer_pulled"), "--max-instances", "8"};
  const Finished automatic = run_program(few);
  EXPECT_EQ(automatic.exit_code, 0) << automatic.err;
  EXPECT_NE(automatic.out.find("Simulated by Bullet's stepper"), std::string::npos) << automatic.out;
  EXPECT_NE(run_program({"predict", scenario("drawer_pulled"), "--stepper", "lockstep"}).err.find("--stepper bullet"),
            std::string::npos);
  EXPECT_NE(run_program({"validate", scene}).out.find("1 object, "), std::string::npos);
}

TEST(CommandLine, TextThatIsNotUtf8IsRefusedWhereItIsGiven) {
  const ScratchDir folder;
  const std::string output = (folder.path() / "r.mcap").string();
  const std::vector<std::vector<std::string>> commands = {
      {"ask", "where", "\xff"},
      {"ask", "\xff"},
      {"ask", "--question", "{\"id\": \"\xff\", \"where\": {}}"},
      {"serve", "--scene", scenario("milk_on_bin"), "--record", output, "--world-frame", "w\xc3"},
      {"serve", "--scene", scenario("milk_on_bin"), "--record", output, "--depth-topic", "/\xff"}};
  for (const std::vector<std::string>& command : commands) {
    std::vector<std::string> args = command;
    args.emplace_back("--json");
    const Finished finished = run_program(args);
    EXPECT_EQ(finished.exit_code, 2) << finished.err;
    EXPECT_NE(finished.err.find("is not UTF-8"), std::string::npos) << finished.err;
    EXPECT_TRUE(parsed(finished).contains("error")) << finished.out;
  }
}

TEST(CommandLine, TooLittleTimeIsNoBadInput) {
  const ScratchDir folder;
  // 200 boxes in heaps: one instance takes minutes, most of it to see whether they rest.
  std::string scene =
      "name: heaps\nmodels:\n  box: {box: [0.12, 0.08, 0.1], mass: 0.4}\n"
      "supports:\n  floor: {ground: {size: 4}}\nobjects:\n";
  for (int i = 0; i < 200; ++i) {
    scene += "  b" + std::to_string(i) + ": {model: box, pose: {position: [" + std::to_string(0.13 * (i % 6)) + ", " +
             std::to_string(0.1 * (i / 6 % 6)) + ", " + std::to_string(0.06 + 0.11 * (i / 36)) + "]}}\n";
  }
  write_file(folder.path() / "heaps.yaml", scene);
  const Finished finished =
      run_program({"predict", (folder.path() / "heaps.yaml").string(), "--json", "--max-seconds", "0.001"});
  EXPECT_EQ(finished.exit_code, 1) << finished.err;
  EXPECT_NE(parsed(finished)["error"].get<std::string>().find("give more time"), std::string::npos) << finished.out;
}

TEST(CommandLine, PredictWritesAHeatMapAndRefusesTimesThatAreNone) {
  const ScratchDir folder;
  const std::string picture = (folder.path() / "ends.png").string();
  const Finished finished =
      run_program({"predict", scenario("milk_on_bin"), "--max-instances", "64", "--heat-map", picture});
  EXPECT_EQ(finished.exit_code, 0) << finished.err;
  EXPECT_EQ(read_file(picture).substr(1, 3), "PNG");
  for (const char* budget : {"0", "-1s", "0ms", "1 fortnight", "nan", "1e9"}) {
    const Finished refused = run_program({"predict", scenario("milk_on_bin"), "--budget", budget});
    EXPECT_EQ(refused.exit_code, 2) << budget;
    EXPECT_NE(refused.err.find("no time above 0"), std::string::npos) << refused.err;
  }
  EXPECT_EQ(run_program({"predict", scenario("tossed_cube"), "--budget", "60000 ms"}).exit_code, 0);
}

TEST(CommandLine, APredictionOfThingsInEachOtherSaysSo) {
  const ScratchDir folder;
  write_file(folder.path() / "deep.yaml",
             "name: deep\nmodels:\n  box: {box: [0.1, 0.1, 0.1], mass: 0.4}\nsupports:\n  floor: {ground: {size: 4}}\n"
             "objects:\n  box: {model: box, pose: {position: [{normal: [0, 0.01]}, 0, 0.02]}}\n"
             "outcomes:\n  low: {object: box, below: 0.2}\n");
  const Finished finished = run_program(
      {"predict", (folder.path() / "deep.yaml").string(), "--json", "--max-instances", "64", "--outcomes-only"});
  EXPECT_EQ(finished.exit_code, 0) << finished.err;
  const nlohmann::ordered_json document = parsed(finished);
  EXPECT_NEAR(document["overlaps"]["deepest"].get<double>(), 0.03, 0.001);
  EXPECT_EQ(document["overlaps"]["share"], 1.0);
  EXPECT_NE(document["remarks"][0].get<std::string>().find("by up to 30 mm"), std::string::npos);
  EXPECT_EQ(document["certificates"]["used"], true);
  EXPECT_TRUE(document["final_poses"].empty());
}

TEST(CommandLine, TwoOutputsAreTwoFiles) {
  const ScratchDir folder;
  const std::string output = (folder.path() / "out").string();
  const Finished finished = run_program({"predict", scenario("milk_on_bin"), "--max-instances", "4", "--report", output,
                                         "--heat-map", folder.path().string() + "/./out"});
  EXPECT_EQ(finished.exit_code, 2) << finished.err;
  EXPECT_NE(finished.err.find("name two"), std::string::npos) << finished.err;
  EXPECT_FALSE(std::filesystem::exists(output));
}

TEST(CommandLine, OptionsThatMakeNoSenseAreRefused) {
  const ScratchDir folder;
  const std::string output = (folder.path() / "run.mcap").string();
  const std::string scene = scenario("milk_on_bin");
  const std::pair<std::vector<std::string>, std::string> all[] = {
      {{"replay", scene, "--speed", "2"}, "--over-dds"},
      {{"replay", scene, "--ask", "1:{}"}, "--over-dds"},
      {{"replay", scene, "--loop"}, "--over-dds"},
      {{"replay", scene, "--over-dds", "--loop", "--ask", "1:{}"}, "--ask"},
      {{"replay", scene, "--over-dds", "--loop", "--report", "page.html"}, "--loop"},
      {{"replay", scene, "--over-dds", "--speed", "1e-300"}, "between 0.001 and 10000"},
      {{"replay", scene, "--over-dds", "--speed", "1e300"}, "between 0.001 and 10000"},
      {{"replay", scene, "--over-dds", "--ask", "1:garbage"}, "--ask SECONDS:JSON"},
      {{"replay", scene, "--over-dds", "--ask", "inf:{}"}, "--ask SECONDS:JSON"},
      {{"replay", scene, "--scene", ""}, "file name"},
      {{"replay", scene, "--world-frame", ""}, "name of a frame"},
      {{"replay", scene, "--from", "2", "--to", "1"}, "exchange them"},
      {{"replay", scene, "--from", "1", "--to", "1"}, "give a later --to"},
      {{"record", "-o", output, "--rate", "10"}, "--simulate"},
      {{"record", "-o", output, "--simulate", scene, "--depth-topic", ""}, "depth topic has no name"},
      {{"record", "-o", output, "--simulate", scene, "--depth-topic", "/a", "--color-topic", "/a"},
       "is the depth topic"},
      {{"serve", "--scene", scene, "--tf-topic", "/tf_static"}, "is the tf topic"}};
  for (const auto& [arguments, reason] : all) {
    const Finished finished = run_program(arguments);
    EXPECT_EQ(finished.exit_code, 2) << finished.err;
    EXPECT_NE(finished.err.find(reason), std::string::npos) << finished.err;
    EXPECT_FALSE(std::filesystem::exists(output));
  }
}

TEST(CommandLine, AnInputIsNeverOverwritten) {
  const ScratchDir folder;
  const std::string scene = (folder.path() / "scene.yaml").string();
  std::filesystem::copy_file(scenario("milk_on_bin"), scene);
  const std::string before = read_file(scene);
  for (const std::vector<std::string>& args :
       std::vector<std::vector<std::string>>{{"record", "--simulate", scene, "-o", scene},
                                             {"predict", scene, "--max-instances", "4", "--report", scene},
                                             {"serve", "--scene", scene, "--record", scene}}) {
    const Finished finished = run_program(args);
    EXPECT_EQ(finished.exit_code, 2) << finished.err;
    EXPECT_NE(finished.err.find("overwritten"), std::string::npos) << finished.err;
    EXPECT_EQ(read_file(scene), before);
  }
}

TEST(CommandLine, OutputsThatCannotBeAreRefusedFirst) {
  for (const std::vector<std::string>& args :
       std::vector<std::vector<std::string>>{{"predict", scenario("tossed_cube"), "--report", ""},
                                             {"predict", scenario("tossed_cube"), "--heat-map", ""},
                                             {"calibrate", "nowhere", "-o", ""},
                                             {"serve", "--scene", scenario("tossed_cube"), "--record", ""}}) {
    const Finished finished = run_program(args);
    EXPECT_EQ(finished.exit_code, 2) << args[0];
    EXPECT_NE(finished.err.find("a file name is needed"), std::string::npos) << finished.err;
  }
  if (!std::filesystem::exists("/dev/full")) GTEST_SKIP() << "this system has no /dev/full";
  // Before anything is simulated: a budget of hours would not end.
  const Finished full = run_program({"predict", scenario("tossed_cube"), "--budget", "60min", "--tolerance", "0.0001",
                                     "--max-instances", "4194304", "--report", "/dev/full"});
  EXPECT_EQ(full.exit_code, 1) << full.err;
  EXPECT_NE(full.err.find("--report /dev/full: can't be written"), std::string::npos) << full.err;
}

TEST(CommandLine, CalibrateSaysWhichOptionsBelongToWhat) {
  const auto message = [](std::vector<std::string> args) {
    args.insert(args.begin(), "calibrate");
    const Finished finished = run_program(args);
    EXPECT_EQ(finished.exit_code, 2);
    return finished.err;
  };
  EXPECT_NE(message({"cube_tosses"}).find("cube_tosses takes --data"), std::string::npos);
  EXPECT_NE(message({"folder", "-o", "x.yaml", "--from", "shipped"}).find("--from goes with cube_tosses"),
            std::string::npos);
  EXPECT_NE(message({"folder"}).find("-o is missing"), std::string::npos);
  EXPECT_NE(run_program({"calibrate", "--help"}).out.find("required"), std::string::npos);
}

TEST(CommandLine, EveryScenarioIsValid) {
  for (const auto& entry : std::filesystem::directory_iterator(source_dir() / "scenarios")) {
    if (entry.path().extension() != ".yaml") continue;
    const Finished finished = run_program({"validate", entry.path().string(), "--json"});
    EXPECT_EQ(finished.exit_code, 0) << finished.out << finished.err;
    EXPECT_TRUE(parsed(finished)["files"][0]["valid"].get<bool>());
  }
}

TEST(CommandLine, AMistypedKeyIsNamedWithItsLineAndTheRightOne) {
  const ScratchDir folder;
  std::string text = read_file(scenario("milk_on_bin"));
  const std::size_t at = text.find("friction:");
  text.replace(at, 9, "fricton:");
  const auto line = 1 + std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(at), '\n');
  write_file(folder.path() / "bad.yaml", text);
  const Finished finished = run_program({"validate", (folder.path() / "bad.yaml").string()});
  EXPECT_EQ(finished.exit_code, 2);
  EXPECT_NE(finished.out.find("bad.yaml:" + std::to_string(line)), std::string::npos) << finished.out;
  EXPECT_NE(finished.out.find("'friction'"), std::string::npos) << finished.out;
}

TEST(CommandLine, PredictionsAreTheSameBytesForTheSameSeedAndAnyThreads) {
  std::vector<std::string> documents;
  for (const char* threads : {"1", "2", "2"}) {
    const Finished finished = run_program({"predict", scenario("milk_on_bin"), "--json", "--seed", "1", "--threads",
                                           threads, "--max-instances", "64", "--tolerance", "0.001"});
    ASSERT_EQ(finished.exit_code, 0) << finished.err;
    ordered_json json = parsed(finished);
    EXPECT_EQ(json["instances"], 64);
    EXPECT_GT(json["simulated_seconds"].get<double>(), 1.0);
    json.erase("wall_seconds");
    json.erase("cpu_seconds");
    documents.push_back(json.dump());
    double sum = 0.0;
    for (const ordered_json& outcome : json["outcomes"]) {
      const double p = outcome["probability"].get<double>();
      EXPECT_LE(outcome["interval"][0].get<double>(), p);
      EXPECT_GE(outcome["interval"][1].get<double>(), p);
      if (outcome.value("group", "") == "where") sum += p;
    }
    EXPECT_NEAR(sum, 1.0, 1e-9);
  }
  EXPECT_EQ(documents[0], documents[1]);
  EXPECT_EQ(documents[1], documents[2]);
}

TEST(CommandLine, InspectMakesAModelThatASceneCanUse) {
  const ScratchDir folder;
  // A cube of 100 in a file without a unit.
  write_file(folder.path() / "cube.obj",
             "v 0 0 0\nv 100 0 0\nv 100 100 0\nv 0 100 0\nv 0 0 100\nv 100 0 100\nv 100 100 100\nv 0 100 100\n"
             "f 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n");
  const Finished metres = run_program({"inspect", (folder.path() / "cube.obj").string(), "--json"});
  EXPECT_EQ(metres.exit_code, 0) << metres.err;
  EXPECT_NE(parsed(metres)["remarks"].dump().find("millimetres"), std::string::npos) << metres.out;

  const Finished made = run_program({"inspect", (folder.path() / "cube.obj").string(), "--scale", "0.001", "--density",
                                     "1000", "-o", (folder.path() / "cube.yaml").string(), "--report",
                                     (folder.path() / "cube.html").string(), "--json"});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  EXPECT_EQ(run_program({"validate", (folder.path() / "cube.yaml").string()}).exit_code, 0);
  const ordered_json found = parsed(made);
  EXPECT_NEAR(found["volume"].get<double>(), 1e-3, 1e-12);
  EXPECT_NEAR(found["solid"]["mass"].get<double>(), 1.0, 1e-9);
  EXPECT_EQ(found["resting_poses"].size(), 6u);
  EXPECT_NE(read_file(folder.path() / "cube.html").find("<html"), std::string::npos);

  write_file(folder.path() / "scene.yaml",
             "name: cube\nmodels:\n  cube: {file: cube.yaml}\nsupports:\n  floor: {ground: {size: 2}}\n"
             "objects:\n  cube: {model: cube, pose: {position: [0, 0, 0.3]}}\n"
             "outcomes:\n  lies: {object: cube, resting_on: floor}\n");
  const Finished predicted =
      run_program({"predict", (folder.path() / "scene.yaml").string(), "--json", "--max-instances", "8"});
  ASSERT_EQ(predicted.exit_code, 0) << predicted.err;
  EXPECT_EQ(parsed(predicted)["outcomes"][0]["probability"], 1.0);
}

// A mug of 8 cm by 10 cm with walls of 4 mm, as a scan gives it: a closed mesh.
void write_mug(const std::filesystem::path& path) {
  const geometry::TriangleMesh mug =
      geometry::make_lathe({{0.0, 0.0}, {0.04, 0.0}, {0.04, 0.1}, {0.036, 0.1}, {0.036, 0.006}, {0.0, 0.006}}, 48);
  ASSERT_TRUE(interfaces::write_ply(path, mug).ok());
}

// What is drawn of a scanned table in each frame is simplified: who has one is told, whatever he does with it.
TEST(CommandLine, NamesSurroundingsOfWhichNotAllTrianglesAreDrawn) {
  const ScratchDir folder;
  const auto file = [&](const std::string& name) { return (folder.path() / name).string(); };
  const auto write_table = [&](const std::string& name, int cells) {
    std::string obj;
    for (int i = 0; i <= cells; ++i)
      for (int j = 0; j <= cells; ++j) obj += "v " + std::to_string(0.01 * i) + " " + std::to_string(0.01 * j) + " 0\n";
    const auto corner = [cells](int i, int j) { return std::to_string(1 + i * (cells + 1) + j); };
    for (int i = 0; i < cells; ++i)
      for (int j = 0; j < cells; ++j) {
        obj += "f " + corner(i, j) + " " + corner(i + 1, j) + " " + corner(i + 1, j + 1) + "\n";
        obj += "f " + corner(i, j) + " " + corner(i + 1, j + 1) + " " + corner(i, j + 1) + "\n";
      }
    write_file(file(name), obj);
  };
  const auto remarks_on = [&](const std::string& table) {
    write_file(file("scanned.yaml"),
               "name: scanned\nmodels:\n  box: {box: [0.1, 0.1, 0.1], density: 500, symmetry: cuboid}\n"
               "supports:\n  desk: {mesh: {file: " +
                   table +
                   ", use: surface}}\n"
                   "objects:\n  box: {model: box, pose: {position: [0.3, 0.3, 0.05]}}\n");
    const Finished valid = run_program({"validate", file("scanned.yaml"), "--json"});
    EXPECT_EQ(valid.exit_code, 0) << valid.err << valid.out;
    return parsed(valid)["files"][0]["remarks"].dump();
  };
  write_table("fine.obj", 110);
  write_table("coarse.obj", 90);
  EXPECT_NE(remarks_on("fine.obj").find("supports.desk: of its 24200 triangles at most 20000 are drawn"),
            std::string::npos);
  EXPECT_EQ(remarks_on("coarse.obj").find("supports.desk"), std::string::npos);
}

TEST(CommandLine, WhatFallsIntoAnInspectedMugLandsInIt) {
  const ScratchDir folder;
  const auto file = [&](const std::string& name) { return (folder.path() / name).string(); };
  write_mug(file("mug.ply"));
  const Finished made = run_program({"inspect", file("mug.ply"), "-o", file("mug.yaml")});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  EXPECT_EQ(read_file(file("mug.yaml")).find("use:"), std::string::npos) << "nobody chose one";
  EXPECT_NE(made.out.find("% of its convex hull is hollow"), std::string::npos) << made.out;

  const auto scene = [](const std::string& model) {
    return "name: mug\nduration: 2\nmodels:\n  mug: {file: " + model +
           "}\n  ball: {sphere: 0.012, mass: 0.01, restitution: 0.1}\n"
           "supports:\n  floor: {ground: {size: 2}}\n"
           "objects:\n  mug: {model: mug, pose: {position: [0, 0, 0.0005]}}\n"
           "  ball: {model: ball, pose: {position: [{normal: [0, 0.001]}, {normal: [0, 0.001]}, 0.16]}}\n"
           "outcomes:\n  in_mug: {object: ball, inside: {position: [0, 0, 0.05], size: [0.08, 0.08, 0.09]}}\n";
  };
  write_file(file("scene.yaml"), scene("mug.yaml"));
  const Finished valid = run_program({"validate", file("scene.yaml"), "--json"});
  ASSERT_EQ(valid.exit_code, 0) << valid.err;
  EXPECT_TRUE(parsed(valid)["files"][0]["warnings"].empty()) << valid.out;
  // The ball names no symmetry: a remark, no warning, and only where it may be tracked.
  EXPECT_EQ(parsed(valid)["files"][0]["remarks"].size(), 1U) << valid.out;
  const Finished said = run_program({"validate", file("scene.yaml")});
  EXPECT_NE(said.out.find("models.ball: it looks the same when it is turned in any way"), std::string::npos)
      << said.out;
  EXPECT_NE(said.out.find("write 'symmetry: ball', or 'symmetry: none' if the turn counts"), std::string::npos);
  const Finished lands = run_program({"predict", file("scene.yaml"), "--json", "--max-instances", "32"});
  EXPECT_EQ(lands.err.find("symmetry"), std::string::npos) << lands.err;
  ASSERT_EQ(lands.exit_code, 0) << lands.err;
  EXPECT_GT(parsed(lands)["outcomes"][0]["probability"].get<double>(), 0.9) << lands.out;

  // Who chooses the hull is told what that hides, by every verb that reads the model.
  const Finished chosen =
      run_program({"inspect", file("mug.ply"), "-o", file("solid.yaml"), "--use", "convex_hull", "--json"});
  ASSERT_EQ(chosen.exit_code, 0) << chosen.err;
  EXPECT_NE(read_file(file("solid.yaml")).find("use: convex_hull"), std::string::npos);
  EXPECT_NEAR(parsed(chosen)["hollow_share_of_hull"].get<double>(),
              1.0 - (0.04 * 0.04 * 0.1 - 0.036 * 0.036 * 0.094) / (0.04 * 0.04 * 0.1), 1e-9);
  EXPECT_NE(parsed(chosen)["remarks"].dump().find("with use: convex_hull nothing gets into that"), std::string::npos);
  write_file(file("solid_scene.yaml"), scene("solid.yaml"));
  const Finished warned = run_program({"validate", file("solid_scene.yaml"), file("solid.yaml"), "--json"});
  for (const auto& document : parsed(warned)["files"]) {
    EXPECT_TRUE(document["valid"].get<bool>());
    EXPECT_NE(document["warnings"].dump().find("76 % of its convex hull is hollow in the mesh"), std::string::npos)
        << warned.out;
  }
  EXPECT_NE(run_program({"validate", file("solid.yaml")}).out.find("valid: a model file, 1 warning"),
            std::string::npos);
  const Finished misses = run_program({"predict", file("solid_scene.yaml"), "--json", "--max-instances", "32"});
  EXPECT_LT(parsed(misses)["outcomes"][0]["probability"].get<double>(), 0.1) << misses.out;
  EXPECT_NE(misses.err.find("76 % of its convex hull is hollow"), std::string::npos) << misses.err;
}

TEST(CommandLine, EachStepperSaysWhichHullsItSimplifies) {
  const ScratchDir folder;
  const auto file = [&](const std::string& name) { return (folder.path() / name).string(); };
  write_file(file("scene.yaml"),
             "name: ball\nduration: 0.1\nmodels:\n  ball: {mesh: {file: ball.ply, use: convex_hull}, mass: 0.1}\n"
             "supports:\n  floor: {ground: {size: 2}}\nobjects:\n  ball: {model: ball, pose: {position: [0, 0, 1]}}\n");
  const auto said = [&](int segments, const std::string& stepper) {
    EXPECT_TRUE(interfaces::write_ply(file("ball.ply"), geometry::make_mesh(geometry::Sphere{0.05}, segments)).ok());
    const Finished done = run_program({"predict", file("scene.yaml"), "--max-instances", "2", "--stepper", stepper});
    EXPECT_EQ(done.exit_code, 0) << done.err;
    return done.out;
  };
  const std::string few = "Hulls of more than 64 vertices, or 16 corners a side, are simplified, here by up to ";
  const std::string many = "Bullet's stepper simplifies hulls of more than 1500 vertices, here by up to 0.";
  for (const int segments : {40, 80}) {  // about 760 and 3100 vertices
    const std::string lockstep = said(segments, "lockstep"), bullet = said(segments, "bullet");
    EXPECT_NE(lockstep.find(few), std::string::npos) << lockstep;
    EXPECT_EQ(lockstep.find(many), std::string::npos) << lockstep;
    EXPECT_EQ(bullet.find(few), std::string::npos) << bullet;
    EXPECT_EQ(bullet.find(many) != std::string::npos, segments == 80) << bullet;
  }
  const std::string inspected = run_program({"inspect", file("ball.ply")}).out;
  EXPECT_NE(inspected.find(" vertices, in lockstep "), std::string::npos) << inspected;
}

TEST(CommandLine, AMeshInMillimetresIsSaidFirst) {
  const ScratchDir folder;
  const auto file = [&](const std::string& name) { return (folder.path() / name).string(); };
  geometry::TriangleMesh can = geometry::scaled(geometry::make_mesh(geometry::Cylinder{0.0048, 0.011}, 24), 1000.0);
  ASSERT_TRUE(interfaces::write_ply(file("can.ply"), can).ok());
  const std::string first = run_program({"inspect", file("can.ply")}).out;
  EXPECT_EQ(first.rfind("warning: the bounding box is 9.6 x 9.6 x 11 m: the mesh is probably in millimetres", 0), 0u)
      << first;
  EXPECT_EQ(first.find("millimetres"), first.rfind("millimetres")) << "and once";
  // As a model, and as a support, which may be as large.
  write_file(file("model.yaml"), "model: {mesh: {file: can.ply}, mass: 0.3}\n");
  write_file(file("scene.yaml"),
             "name: can\nsupports:\n  can: {mesh: {file: can.ply}}\nmodels:\n  b: {sphere: 0.1, mass: 1}\n"
             "objects:\n  b: {model: b, pose: {position: [0, 0, 8]}}\n");
  for (const char* name : {"model.yaml", "scene.yaml"}) {
    const Finished validated = run_program({"validate", file(name)});
    EXPECT_NE(validated.err.find("the mesh is probably in millimetres"), std::string::npos) << validated.err;
  }
  const Finished predicted = run_program({"predict", file("scene.yaml"), "--max-instances", "2"});
  EXPECT_NE(predicted.err.find("the mesh is probably in millimetres"), std::string::npos) << predicted.err;
  can = geometry::scaled(can, 10.0);
  ASSERT_TRUE(interfaces::write_ply(file("can.ply"), can).ok());
  const Finished refused = run_program({"validate", file("model.yaml")});
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_NE(refused.out.find("bounding box is 96 x 96 x 110 m: the mesh is probably in millimetres: give scale: 0.001"),
            std::string::npos)
      << refused.out;
}

TEST(CommandLine, InspectionOfALargeMeshSaysHowFarItIs) {
  const ScratchDir folder;
  const std::string path = (folder.path() / "ball.ply").string();
  geometry::TriangleMesh ball = geometry::make_mesh(geometry::Sphere{0.1}, 480);
  ball.triangles.resize(ball.triangles.size() - 9);  // open
  ASSERT_TRUE(interfaces::write_ply(path, ball).ok());
  ASSERT_GT(std::filesystem::file_size(path), 4u << 20);
  const Finished done = run_program({"inspect", path});
  EXPECT_EQ(done.exit_code, 0) << done.err;
  EXPECT_NE(done.err.find("inspecting: 40 %, convex hull"), std::string::npos) << done.err;
  EXPECT_TRUE(run_program({"inspect", path, "-q"}).err.empty());
}

TEST(CommandLine, PredictWritesAReportWithTheStartAndAHeatMapOfEachObject) {
  const ScratchDir folder;
  for (const auto& [name, pictures] : {std::pair{"milk_on_bin", 2}, std::pair{"five_objects_pushed", 6}}) {
    const std::string report = (folder.path() / "report.html").string();
    const Finished finished = run_program({"predict", scenario(name), "--max-instances", "16", "--report", report});
    ASSERT_EQ(finished.exit_code, 0) << finished.err;
    const std::string page = read_file(report);
    std::size_t images = 0;
    for (std::size_t at = 0; (at = page.find("data:image/png", at)) != std::string::npos; ++at) ++images;
    EXPECT_GE(images, static_cast<std::size_t>(pictures)) << name;
    for (const char* outside : {"src=\"http", "href=\"http", "url(http"})
      EXPECT_EQ(page.find(outside), std::string::npos) << "the page needs nothing from elsewhere";
  }
}

}  // namespace
}  // namespace prescene::tests
