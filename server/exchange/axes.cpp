#include "server/exchange/axes.h"

#include <algorithm>
#include <cmath>

#include "server/exchange/xml_read.h"

namespace gonio::exchange {
namespace {

constexpr double kLeastVolume = 1e-12;  // of the box that unit axes span

bool is_zero(const glm::dvec3& v) {
    return v == glm::dvec3(0.0);
}

// Axes and origin of column vectors, or what stands for them.
ReadMatrix made_of(const glm::dmat3& axes, const glm::dvec3& origin) {
    ReadMatrix result;
    const double longest = std::max({glm::length(axes[0]), glm::length(axes[1]), glm::length(axes[2])});
    const bool singular = !(longest > 0.0) || !(std::abs(glm::determinant(axes / longest)) > kLeastVolume);
    if (singular) {
        const bool zeros = longest == 0.0 && is_zero(origin);
        result.state = zeros ? MatrixState::empty : MatrixState::singular;
    } else {
        result.matrix = glm::dmat4(axes);
    }
    result.matrix[3] = glm::dvec4(origin, 1.0);
    return result;
}

}  // namespace

std::optional<std::vector<double>> bracketed_numbers(std::string_view text) {
    std::vector<double> numbers;
    for (std::size_t at = 0; at < text.size();) {
        const std::size_t end = std::min(text.find_first_of("{}, \t\r\n", at), text.size());
        if (end > at) {
            const auto number = number_of(text.substr(at, end - at));
            if (!number || std::abs(*number) > kMostMatrixEntry || numbers.size() == 16) return std::nullopt;
            numbers.push_back(*number);
        }
        at = end + 1;
    }
    return numbers;
}

ReadMatrix mvr_matrix(std::string_view text) {
    const auto numbers = bracketed_numbers(text);
    if (!numbers) return {glm::dmat4(1.0), MatrixState::bad};
    if (numbers->empty()) return {glm::dmat4(1.0), MatrixState::empty};
    const std::size_t count = numbers->size();
    if (count != 12 && count != 16) return {glm::dmat4(1.0), MatrixState::bad};
    const auto row = [&](std::size_t i) {
        const double* at = numbers->data() + i * count / 4;
        return glm::dvec3(at[0], at[1], at[2]);
    };
    return made_of(glm::dmat3(row(0), row(1), row(2)), row(3));
}

ReadMatrix gdtf_matrix(std::string_view text) {
    const auto numbers = bracketed_numbers(text);
    if (text == "None") return {glm::dmat4(1.0), MatrixState::empty};
    if (!numbers) return {glm::dmat4(1.0), MatrixState::bad};
    if (numbers->empty()) return {glm::dmat4(1.0), MatrixState::empty};
    if (numbers->size() != 16) return {glm::dmat4(1.0), MatrixState::bad};
    const auto row = [&](std::size_t i) {
        const double* at = numbers->data() + 4 * i;
        return glm::dvec3(at[0], at[1], at[2]);
    };
    glm::dvec3 origin((*numbers)[3], (*numbers)[7], (*numbers)[11]);
    if (is_zero(origin)) origin = row(3);
    return made_of(glm::dmat3(row(0), row(1), row(2)), origin);
}

glm::dmat4 scene_matrix(const glm::dmat4& parent_from_object_mm) {
    glm::dmat4 metres = parent_from_object_mm;
    metres[3] = glm::dvec4(glm::dvec3(metres[3]) / 1000.0, 1.0);
    return y_up_from_z_up() * metres * z_up_from_y_up();
}

}  // namespace gonio::exchange
