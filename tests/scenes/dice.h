// Random numbers for scenes that follow from a seed.
#pragma once

#include <cmath>
#include <glm/glm.hpp>
#include <random>

#include "server/scene/orientation.h"

namespace gonio::test {

struct Dice {
    std::mt19937_64 random;
    double between(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random); }
    // Evenly over orders of magnitude.
    double magnitude(double low, double high) { return std::exp(between(std::log(low), std::log(high))); }
    int upto(int n) { return std::uniform_int_distribution<int>(0, n)(random); }
    bool chance(double p) { return between(0, 1) < p; }
    glm::dvec3 within(double r) { return {between(-r, r), between(-r, r), between(-r, r)}; }
    glm::dquat turn() { return orientation_of({between(-4, 4), between(-4, 4), between(-4, 4)}); }
};

}  // namespace gonio::test
