// SPDX-License-Identifier: Apache-2.0
// Measures (pixels) and colours that the parts of a heat map's picture share.
#pragma once

#include "prescene/geometry/image.h"

namespace prescene::service {

constexpr int kPanelWidth = 800, kPanelHeight = 640, kMargin = 36, kLeftAxis = 58, kTitle = 104;
constexpr int kPictureWidth = kLeftAxis + 2 * kPanelWidth + 3 * kMargin;
constexpr geometry::Rgb kInk = {35, 38, 45}, kSoft = {105, 110, 120}, kFrame = {150, 155, 165};
/// Shares of all ends that the lines hold.
constexpr double kOutlinedShares[] = {0.5, 0.9};

}  // namespace prescene::service
