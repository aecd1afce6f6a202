// Matrices as MVR and GDTF write them, and their axes: right-handed, Z up. The scene is right-handed, Y up.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <string_view>
#include <vector>

namespace gonio::exchange {

// Result: (x, y, z) -> (x, z, -y), and back.
inline glm::dmat4 y_up_from_z_up() {
    return {{1, 0, 0, 0}, {0, 0, -1, 0}, {0, 1, 0, 0}, {0, 0, 0, 1}};
}
inline glm::dmat4 z_up_from_y_up() {
    return {{1, 0, 0, 0}, {0, 0, 1, 0}, {0, -1, 0, 0}, {0, 0, 0, 1}};
}

inline constexpr double kMostMatrixEntry = 1e9;  // greater numbers are no matrix

// Result: the numbers of "{1,0,0}{0,1,0}…", at most 16; nothing where the text is anything else, or where a number is
// not finite or beyond kMostMatrixEntry. An empty text has no numbers.
std::optional<std::vector<double>> bracketed_numbers(std::string_view text);

// How a matrix was read.
enum class MatrixState : std::uint8_t {
    as_written,
    empty,     // no text, or zeros alone: the identity
    bad,       // no numbers: the identity
    singular,  // its axes span no space: their identity, with the origin as written
};
struct ReadMatrix {
    glm::dmat4 matrix{1.0};
    MatrixState state = MatrixState::as_written;
};

// text: MVR's {u}{v}{w}{o} of three numbers each, in mm; rows of four are accepted, their fourth number is left out.
// Result: parent_from_object of column vectors, in mm: p' = x u + y v + z w + o.
ReadMatrix mvr_matrix(std::string_view text);
// text: GDTF's {r0}{r1}{r2}{r3} of four numbers each, in m. Result: parent_from_geometry of column vectors: p' = x r0 +
// y r1 + z r2 + the fourth column. Where that is zero and the fourth row is not, the fourth row is added instead.
ReadMatrix gdtf_matrix(std::string_view text);

// parent_from_object: Z up, mm. Result: the same in the scene's axes on both sides, m.
glm::dmat4 scene_matrix(const glm::dmat4& parent_from_object_mm);

}  // namespace gonio::exchange
