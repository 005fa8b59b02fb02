// SPDX-License-Identifier: Apache-2.0
#include "prescene/geometry/mesh_look.h"

#include <algorithm>

namespace prescene::geometry {
namespace {

bool same_texture(const std::shared_ptr<const ColorImage>& a, const std::shared_ptr<const ColorImage>& b) {
  if (a == b) return true;
  if (!a || !b || a->width() != b->width() || a->height() != b->height()) return false;
  return std::equal(a->data(), a->data() + a->size(), b->data());
}

}  // namespace

bool same_look(const LookPtr& a, const LookPtr& b) {
  if (a == b) return true;
  return a && b && a->vertex_colors == b->vertex_colors && a->texture_places == b->texture_places &&
         same_texture(a->texture, b->texture);
}

}  // namespace prescene::geometry
