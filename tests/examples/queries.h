// SPDX-License-Identifier: Apache-2.0
// What the examples in the headers of queries take for granted.
#pragma once

#include <memory>

#include "prescene/belief/belief.h"
#include "prescene/belief/query.h"
#include "prescene/core/parallel.h"
#include "prescene/core/random.h"
#include "prescene/queries/achieve_comparison.h"
#include "prescene/queries/explain.h"
#include "prescene/queries/parameter_search.h"
#include "prescene/queries/path_error.h"
#include "prescene/queries/query_engine.h"
#include "prescene/queries/relation_history.h"
#include "prescene/queries/relations.h"
#include "prescene/queries/why.h"

namespace prescene::queries::given_queries {

extern const decltype(QueryContext::make_simulator) make_simulator;
extern core::ThreadPool pool;
extern const std::shared_ptr<const belief::Belief> snapshot;
extern const belief::Query query;

namespace explain_h {
extern const ExplainContext context;
}  // namespace explain_h

}  // namespace prescene::queries::given_queries

namespace prescene::queries::given_queries::why_h {
extern const ExplainContext frames_context;
extern const PixelRatios pixel_ratios;
extern const std::vector<WindowFrame> frames;
}  // namespace prescene::queries::given_queries::why_h

namespace prescene::queries::given_queries::relations_h {
extern const QueryContext context;
}

namespace prescene::queries::given_queries::relation_history_h {
extern const QueryContext context;
extern const belief::TimelineQuery question;
}  // namespace prescene::queries::given_queries::relation_history_h

namespace prescene::queries::given_queries::confidence_sequence_h {
extern const int successes, draws;
}

namespace prescene::queries::given_queries::parameter_search_h {
extern TrialRunner& trials;
extern const core::RandomStream stream;
}  // namespace prescene::queries::given_queries::parameter_search_h

namespace prescene::queries::given_queries::achieve_comparison_h {
extern const std::shared_ptr<const belief::Scene> scene;
extern const belief::AchieveQuery question;
extern const QueryContext context;
}  // namespace prescene::queries::given_queries::achieve_comparison_h

namespace prescene::queries::given_queries::path_error_h {
extern const double radius;
extern const geometry::Vector3d up;
extern const geometry::SymmetryGroup symmetry;
extern const geometry::Pose X_WO;
extern const FramePeak peak;
}  // namespace prescene::queries::given_queries::path_error_h
