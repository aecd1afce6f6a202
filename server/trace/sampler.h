// Sample points in [0, 1): Owen-scrambled Sobol pairs, a pair per decision of a path (Burley 2020, "Practical
// Hash-based Owen Scrambling", padded two-dimensional sequences). A stream is a function of its seed alone; the first
// 2^k points of any pair are stratified in every elementary interval.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <glm/glm.hpp>
#include <numbers>

namespace gonio::trace {

// Result: a well mixed 32-bit hash (the finaliser of MurmurHash3 over a running state).
inline std::uint32_t mix_bits(std::uint32_t state, std::uint32_t value) {
    std::uint32_t x = state ^ (value + 0x9e3779b9u + (state << 6) + (state >> 2));
    x ^= x >> 16, x *= 0x85ebca6bu;
    x ^= x >> 13, x *= 0xc2b2ae35u;
    return x ^ (x >> 16);
}

inline std::uint32_t reverse_bits(std::uint32_t x) {
    x = ((x >> 1) & 0x55555555u) | ((x & 0x55555555u) << 1);
    x = ((x >> 2) & 0x33333333u) | ((x & 0x33333333u) << 2);
    x = ((x >> 4) & 0x0f0f0f0fu) | ((x & 0x0f0f0f0fu) << 4);
    return __builtin_bswap32(x);
}

// Result: x with every bit flipped by a hash of the bits above it: a random permutation that keeps elementary
// intervals.
inline std::uint32_t owen_scramble(std::uint32_t x, std::uint32_t seed) {
    x = reverse_bits(x);
    x += seed;
    x ^= x * 0x6c50b47cu;
    x ^= x * 0xb82f1e52u;
    x ^= x * 0xc7afe638u;
    x ^= x * 0x8d22f6e6u;
    return reverse_bits(x);
}

// The second dimension of Sobol's sequence; the first is reverse_bits.
inline std::uint32_t sobol_second(std::uint32_t index) {
    std::uint32_t result = 0;
    for (std::uint32_t column = 1u << 31; index != 0; index >>= 1, column ^= column >> 1) {
        if (index & 1u) result ^= column;
    }
    return result;
}

// Result: the bits as a number in [0, 1).
inline float unit_interval(std::uint32_t bits) {
    return static_cast<float>(bits >> 8) * 0x1p-24f;
}

// Result: point `index` of Sobol's first two dimensions, each Owen-scrambled by its own seed.
inline glm::vec2 scrambled_pair(std::uint32_t index, std::uint32_t first_seed, std::uint32_t second_seed) {
    return {unit_interval(owen_scramble(reverse_bits(index), first_seed)),
            unit_interval(owen_scramble(sobol_second(index), second_seed))};
}

// Result: a direction about +Z distributed as its cosine, unit length. random: a pair in [0, 1).
inline glm::vec3 cosine_hemisphere(glm::vec2 random) {
    const float r = std::sqrt(random.x), phi = 2.0f * std::numbers::pi_v<float> * random.y;
    return {r * std::cos(phi), r * std::sin(phi), std::sqrt(std::max(0.0f, 1.0f - random.x))};
}

// Result: a unit vector, evenly over the sphere. random: two numbers in [0, 1).
inline glm::vec3 any_direction(glm::vec2 random) {
    const float z = 1.0f - 2.0f * random.x, r = std::sqrt(std::max(0.0f, 1.0f - z * z)),
                phi = 2.0f * std::numbers::pi_v<float> * random.y;
    return {r * std::cos(phi), r * std::sin(phi), z};
}

// Result: v turned as +Z turns to the unit vector n (Duff et al. 2017).
inline glm::vec3 around(const glm::vec3& n, const glm::vec3& v) {
    const float sign = std::copysign(1.0f, n.z), a = -1.0f / (sign + n.z), b = n.x * n.y * a;
    return v.x * glm::vec3(1.0f + sign * n.x * n.x * a, sign * b, -sign * n.x) +
           v.y * glm::vec3(b, sign + n.y * n.y * a, -n.y) + v.z * n;
}

// One sample of a stream: hands out its numbers decision by decision.
class Sample {
public:
    Sample(std::uint32_t stream_seed, std::uint32_t index) : seed_(stream_seed), index_(index) {}

    // Result: the next pair, each in [0, 1).
    glm::vec2 next() {
        const std::uint32_t seed = mix_bits(seed_, ++pair_);
        const std::uint32_t shuffled = owen_scramble(index_, seed);
        return scrambled_pair(shuffled, mix_bits(seed, 1), mix_bits(seed, 2));
    }

private:
    std::uint32_t seed_, index_, pair_ = 0;
};

}  // namespace gonio::trace
