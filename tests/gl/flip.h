// LDR-FLIP, how different two pictures look when one flips between them: Andersson, Nilsson, Akenine-Möller, Oskarsson,
// Åström, Fairchild, "FLIP: A Difference Evaluator for Alternating Images", Proc. ACM CGIT 3(2), 2020.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

namespace gonio::test {

struct Picture {
    int width = 0, height = 0;
    std::vector<glm::vec3> srgb;  // encoded, 0..1, row by row
};
// Of NV12 (BT.709, limited range), rows from the top.
Picture picture_of_nv12(const std::vector<std::uint8_t>& nv12, int width, int height);

// Pixels per degree of the paper's observer: 0.7 m from a screen 0.7 m wide with 3,840 pixels.
inline constexpr float kPixelsPerDegree = 67.0206f;

// Result: per pixel 0 (the same) to 1 (as different as green and blue). Both pictures have the same size.
std::vector<float> flip(const Picture& reference, const Picture& shown, float pixels_per_degree = kPixelsPerDegree);

// Result: the mean over all pixels.
double mean_flip(const Picture& reference, const Picture& shown);

}  // namespace gonio::test
