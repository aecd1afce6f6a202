// Nodes' own transforms, in double.
#include <tiny_gltf.h>

#include <cmath>
#include <glm/gtc/quaternion.hpp>
#include <string>

#include "server/assets/gltf_import.h"

namespace gonio {

bool is_placeable(const glm::dmat4& matrix) {
    for (int c = 0; c < 4; ++c) {
        for (int r = 0; r < 4; ++r) {
            // Beyond this, single precision behind the seam overflows.
            if (!(std::abs(matrix[c][r]) < 1e30)) return false;
        }
    }
    return true;
}

Result<NodeTransform> transform_of(const tinygltf::Node& node, const std::string& where) {
    NodeTransform local;
    if (node.matrix.size() == 16) {
        for (int i = 0; i < 16; ++i) local.matrix[i / 4][i % 4] = node.matrix[i];
        if (local.matrix[0][3] != 0.0 || local.matrix[1][3] != 0.0 || local.matrix[2][3] != 0.0 ||
            local.matrix[3][3] != 1.0) {
            return Error{"bad_gltf", where + "/matrix", "", "the last row of a node's matrix must be 0 0 0 1"};
        }
        local.axes = glm::dmat3(local.matrix);
        return local;
    }
    const auto vector = [](const std::vector<double>& from, const glm::dvec3& fallback) {
        return from.size() == 3 ? glm::dvec3(from[0], from[1], from[2]) : fallback;
    };
    if (node.rotation.size() == 4) {
        const glm::dquat turn(node.rotation[3], node.rotation[0], node.rotation[1], node.rotation[2]);
        if (!(glm::length(turn) > 1e-6)) {
            return Error{"bad_gltf", where + "/rotation", "0", "the quaternion has no length"};
        }
        local.axes = glm::mat3_cast(glm::normalize(turn));
    }
    const glm::dvec3 scale = vector(node.scale, glm::dvec3(1.0));
    local.matrix = glm::dmat4(local.axes);
    for (int c = 0; c < 3; ++c) local.matrix[c] *= scale[c];
    local.matrix[3] = glm::dvec4(vector(node.translation, glm::dvec3(0.0)), 1.0);
    return local;
}

}  // namespace gonio
