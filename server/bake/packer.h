// Rectangles side by side in a larger one: skyline packing (Jylänki 2010, "A Thousand Ways to Pack the Bin", section 4,
// bottom-left). It ends after one look at each rectangle, whether they fit or not.
#pragma once

#include <glm/glm.hpp>
#include <optional>
#include <span>
#include <vector>

namespace gonio::bake {

// Result: the lower left corner of each rectangle, in their order; nothing where they do not all fit. sizes: at
// least 1.
std::optional<std::vector<glm::ivec2>> pack(std::span<const glm::ivec2> sizes, const glm::ivec2& room);

}  // namespace gonio::bake
