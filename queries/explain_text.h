// SPDX-License-Identifier: Apache-2.0
// Explanations in plain English. Times in them count from the window's start.
#pragma once

#include <string>

#include "prescene/queries/explain.h"

namespace prescene::queries {

/// What happened, if it is this: one sentence.
std::string sentence_of(const Explanation& explanation, const ExplainWindow& window);
/// What would have led to the wanted outcome, about the object of the explanation.
std::string sentence_of(const SmallestChange& change);
/// The answer as a paragraph.
std::string paragraph_of(const ExplainAnswer& answer);

}  // namespace prescene::queries
