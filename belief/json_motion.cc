// SPDX-License-Identifier: Apache-2.0
#include "json_motion.h"

#include <cmath>
#include <limits>

#include "json_values.h"
#include "prescene/belief/json.h"

namespace prescene::belief {
namespace {

constexpr std::size_t kMostDraws = 1u << 16;
constexpr double kNever = -std::numeric_limits<double>::infinity();

const std::vector<std::pair<std::string, EpisodeKind>>& episode_words() {
  static const std::vector<std::pair<std::string, EpisodeKind>> kWords = {
      {"rest", EpisodeKind::kRest}, {"motion", EpisodeKind::kMotion}, {"release", EpisodeKind::kRelease}};
  return kWords;
}

Json poses_json(const std::vector<Pose>& poses) {
  Json json = Json::array();
  for (const Pose& pose : poses) json.push_back(to_json(pose));
  return json;
}

std::vector<Pose> poses_from(const JsonAt& at) {
  std::vector<Pose> poses;
  for (const JsonAt& item : at.items()) poses.push_back(pose_from(item));
  return poses;
}

Json sample_json(const MotionSample& sample) {
  Json deviation = Json::array();
  for (const double value : sample.deviation) deviation.push_back(value);
  return {{"stamp_ns", sample.stamp_ns},
          {"X_WO", to_json(sample.X_WO)},
          {"deviation", std::move(deviation)},
          {"robot", poses_json(sample.robot)}};
}

MotionSample sample_from(const JsonAt& at) {
  MotionSample sample;
  JsonObject fields(at);
  if (const auto stamp = fields.require("stamp_ns")) sample.stamp_ns = stamp->integer(INT64_MIN, INT64_MAX);
  if (const auto pose = fields.require("X_WO")) sample.X_WO = pose_from(*pose);
  if (const auto deviation = fields.require("deviation")) {
    const std::vector<double> values = deviation->numbers(6);
    for (int i = 0; i < 6; ++i) {
      if (values[static_cast<std::size_t>(i)] < 0.0) deviation->fail("standard deviations are at least 0");
      sample.deviation[i] = values[static_cast<std::size_t>(i)];
    }
  }
  if (const auto robot = fields.require("robot")) sample.robot = poses_from(*robot);
  return sample;
}

Json samples_json(const std::vector<MotionSample>& samples) {
  Json json = Json::array();
  for (const MotionSample& sample : samples) json.push_back(sample_json(sample));
  return json;
}

std::vector<MotionSample> samples_from(const JsonAt& at) {
  std::vector<MotionSample> samples;
  for (const JsonAt& item : at.items()) {
    samples.push_back(sample_from(item));
    const std::size_t count = samples.size();
    if (count > 1 && samples[count - 2].stamp_ns >= samples[count - 1].stamp_ns) item.fail("stamps have to ascend");
  }
  return samples;
}

Json episode_json(const MotionEpisode& episode) {
  Json judged = Json::array();
  for (const double value : episode.run_errors) judged.push_back(number_json(value));
  return {{"kind", word_of(episode_words(), episode.kind)},
          {"samples", samples_json(episode.samples)},
          {"V_start", to_json(episode.V_start)},
          {"others", poses_json(episode.others)},
          {"closed", episode.closed},
          {"probed", episode.probed},
          {"run_errors", std::move(judged)}};
}

MotionEpisode episode_from(const JsonAt& at) {
  MotionEpisode episode;
  JsonObject fields(at);
  if (const auto kind = fields.require("kind")) episode.kind = kind->word(episode_words());
  if (const auto samples = fields.require("samples")) {
    episode.samples = samples_from(*samples);
    if (episode.samples.empty()) samples->fail("one sample at least is needed, the start");
  }
  if (const auto twist = fields.require("V_start")) episode.V_start = twist_from(*twist);
  if (const auto others = fields.require("others")) episode.others = poses_from(*others);
  if (const auto closed = fields.require("closed")) episode.closed = closed->boolean();
  if (const auto probed = fields.require("probed")) episode.probed = probed->boolean();
  if (const auto judged = fields.require("run_errors"))
    for (const JsonAt& item : judged->items()) episode.run_errors.push_back(item.number_or_null(kNever));
  return episode;
}

}  // namespace

Json physics_json(const PhysicalBelief& physics) {
  Json draws = Json::array();
  for (const PhysicalDraw& draw : *physics.draws) {
    Json row = Json::array({number_json(draw.log_weight)});
    for (const double u : draw.uniforms) row.push_back(u);
    draws.push_back(std::move(row));
  }
  return {{"lessons", physics.lessons},
          {"learned_ns", physics.learned_ns},
          {"cell", physics.cell},
          {"draws", std::move(draws)}};
}

PhysicalBelief physics_from(const JsonAt& at, int dimensions) {
  PhysicalBelief physics;
  JsonObject fields(at);
  if (const auto lessons = fields.require("lessons"))
    physics.lessons = static_cast<int>(lessons->integer(1, std::numeric_limits<int>::max()));
  if (const auto learned = fields.require("learned_ns")) physics.learned_ns = learned->integer(INT64_MIN, INT64_MAX);
  if (const auto cell = fields.require("cell")) {
    physics.cell = cell->number();
    if (!(physics.cell >= 0.0 && physics.cell <= 1.0)) cell->fail("the width of a cell is between 0 and 1");
  }
  const auto rows = fields.require("draws");
  if (!rows) return physics;
  std::vector<PhysicalDraw> draws;
  double sum = 0.0;
  for (const JsonAt& row : rows->items()) {
    const std::vector<JsonAt> cells = row.items(static_cast<std::size_t>(dimensions) + 1);
    if (cells.empty()) continue;
    PhysicalDraw draw;
    draw.log_weight = cells[0].number_or_null(kNever);
    if (!(draw.log_weight <= 1e-6)) cells[0].fail("the logarithm of a weight of at most 1 is needed");
    sum += std::exp(draw.log_weight);
    for (std::size_t i = 1; i < cells.size(); ++i) {
      draw.uniforms.push_back(cells[i].number());
      if (!(draw.uniforms.back() > 0.0 && draw.uniforms.back() < 1.0))
        cells[i].fail("a number inside (0, 1) is needed");
    }
    draws.push_back(std::move(draw));
  }
  if (dimensions == 0) rows->fail("the object's model leaves no parameter open");
  if (draws.empty() || draws.size() > kMostDraws) rows->fail("1 to 65536 draws are needed");
  if (std::abs(sum - 1.0) > 1e-6) rows->fail("the weights have to sum to 1");
  physics.draws = std::make_shared<const std::vector<PhysicalDraw>>(std::move(draws));
  return physics;
}

Json motion_json(const MotionRecord& motion) {
  Json json{{"X_still", to_json(motion.X_still)},
            {"still_frames", motion.still_frames},
            {"moved_frames", motion.moved_frames},
            {"place_judged", motion.place_judged},
            {"held", motion.held},
            {"episodes_unexplained", motion.episodes_unexplained},
            {"recent", samples_json(motion.recent)}};
  if (motion.episode) json["episode"] = episode_json(*motion.episode);
  return json;
}

MotionRecord motion_from(const JsonAt& at) {
  MotionRecord motion;
  JsonObject fields(at);
  const auto count = [&](const char* key, int& to) {
    if (const auto number = fields.require(key))
      to = static_cast<int>(number->integer(0, std::numeric_limits<int>::max()));
  };
  if (const auto pose = fields.require("X_still")) motion.X_still = pose_from(*pose);
  count("still_frames", motion.still_frames);
  count("moved_frames", motion.moved_frames);
  if (const auto judged = fields.require("place_judged")) motion.place_judged = judged->boolean();
  if (const auto held = fields.require("held")) motion.held = held->boolean();
  count("episodes_unexplained", motion.episodes_unexplained);
  if (const auto recent = fields.require("recent")) motion.recent = samples_from(*recent);
  if (const auto episode = fields.find("episode")) motion.episode = episode_from(*episode);
  return motion;
}

Json grip_json(const GripRecord& grip) {
  return {{"X_GO", to_json(grip.X_GO)}, {"frames", grip.frames}, {"apart_frames", grip.apart_frames}};
}

GripRecord grip_from(const JsonAt& at) {
  GripRecord grip;
  JsonObject fields(at);
  if (const auto pose = fields.require("X_GO")) grip.X_GO = pose_from(*pose);
  if (const auto frames = fields.require("frames"))
    grip.frames = static_cast<int>(frames->integer(0, std::numeric_limits<int>::max()));
  if (const auto frames = fields.require("apart_frames"))
    grip.apart_frames = static_cast<int>(frames->integer(0, std::numeric_limits<int>::max()));
  return grip;
}

Json to_json(const std::vector<ParameterEstimate>& estimates) {
  Json json = Json::array();
  for (const ParameterEstimate& estimate : estimates)
    json.push_back({{"name", estimate.name},
                    {"mean", estimate.mean},
                    {"standard_deviation", estimate.standard_deviation},
                    {"low", estimate.low},
                    {"high", estimate.high}});
  return json;
}

}  // namespace prescene::belief
