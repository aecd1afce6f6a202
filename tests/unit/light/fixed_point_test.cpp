// The iteration of a solve against dense linear algebra: what it promises holds at every step, of any system.
#include "server/transport/fixed_point.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

namespace gonio::transport {
namespace {

// E = S + T(rho E) of n surfels with a few links each. Rows of T sum to at most 1: some links meet nothing.
struct System {
    std::size_t n;
    std::vector<std::vector<std::size_t>> links;  // n: meets nothing
    std::vector<glm::vec4> rho, s;
    glm::vec3 rho_max{0.0f}, s_max{0.0f};

    void bounce(std::span<const glm::vec4> e, std::vector<glm::vec4>& out) const {
        out.resize(n);
        for (std::size_t i = 0; i < n; ++i) {
            glm::dvec4 sum(0.0);
            for (const std::size_t j : links[i])
                if (j < n) sum += glm::dvec4(rho[j] * e[j]);
            out[i] = s[i] + glm::vec4(sum / static_cast<double>(links[i].size()));
        }
    }
    // Result: E by Gaussian elimination in double precision.
    std::vector<glm::dvec3> exact() const {
        std::vector<glm::dvec3> e(n);
        for (int channel = 0; channel < 3; ++channel) {
            std::vector<std::vector<double>> a(n, std::vector<double>(n + 1, 0.0));
            for (std::size_t i = 0; i < n; ++i) {
                a[i][i] += 1.0;
                for (const std::size_t j : links[i]) {
                    if (j < n) a[i][j] -= static_cast<double>(rho[j][channel]) / static_cast<double>(links[i].size());
                }
                a[i][n] = static_cast<double>(s[i][channel]);
            }
            for (std::size_t i = 0; i < n; ++i) {  // diagonally dominant: no pivots
                for (std::size_t k = i + 1; k < n; ++k) {
                    const double factor = a[k][i] / a[i][i];
                    for (std::size_t j = i; factor != 0.0 && j <= n; ++j) a[k][j] -= factor * a[i][j];
                }
            }
            for (std::size_t i = n; i-- > 0;) {
                double sum = a[i][n];
                for (std::size_t j = i + 1; j < n; ++j) sum -= a[i][j] * e[j][channel];
                e[i][channel] = sum / a[i][i];
            }
        }
        return e;
    }
    glm::vec3 residual(std::span<const glm::vec4> e) const {
        std::vector<glm::vec4> f;
        bounce(e, f);
        glm::vec3 most(0.0f);
        for (std::size_t i = 0; i < n; ++i) most = glm::max(most, glm::abs(glm::vec3(f[i] - e[i])));
        return most;
    }
};

// Two to five rooms; a surfel's links stay in its room but for one in a hundred. Light starts at a few surfels of one.
System random_system(std::uint32_t seed) {
    std::mt19937 random(seed);
    const auto between = [&](float low, float high) {
        return std::uniform_real_distribution<float>(low, high)(random);
    };
    const auto upto = [&](std::size_t most) { return std::uniform_int_distribution<std::size_t>(0, most)(random); };
    System system;
    const std::size_t rooms = 2 + upto(3), each = 6 + upto(10);
    system.n = rooms * each;
    const float most = between(0.3f, 1.0f) < 0.5f ? between(0.5f, 0.9f) : between(0.9f, 0.99f);
    const float opens = between(0.0f, 0.1f), strays = between(0.0f, 0.05f);
    for (std::size_t i = 0; i < system.n; ++i) {
        std::vector<std::size_t> links;
        for (std::size_t k = 4 + upto(8); k > 0; --k) {
            const std::size_t room = between(0, 1) < strays ? upto(rooms - 1) : i / each;
            links.push_back(between(0, 1) < opens ? system.n : room * each + upto(each - 1));
        }
        system.links.push_back(links);
        const glm::vec3 rho(between(0.5f, 1.0f) * most, between(0.2f, 1.0f) * most, most);
        system.rho.emplace_back(rho, 0.0f);
        const bool lit = i < each && between(0, 1) < 0.3f;
        system.s.emplace_back(lit ? glm::vec3(between(0, 10), between(0, 100), between(0, 1)) : glm::vec3(0.0f), 0.0f);
        system.rho_max = glm::max(system.rho_max, rho);
        system.s_max = glm::max(system.s_max, glm::vec3(system.s.back()));
    }
    return system;
}

constexpr float kRounding = 1e-5f;  // of single precision, relative to the light

TEST(FixedPoint, NeverDivergesAtAnyStep) {
    Pool pool(1);
    for (const unsigned columns : {0u, 1u, 2u, 4u}) {
        for (std::uint32_t seed = 1; seed <= 300; ++seed) {
            const System system = random_system(seed);
            const glm::vec3 bound = system.s_max / (1.0f - system.rho_max);
            std::vector<glm::vec4> e = system.s;
            FixedPoint iteration(e, bound, columns, pool);
            const Bounce bounce = [&](std::span<const glm::vec4> from, std::vector<glm::vec4>& to) {
                system.bounce(from, to);
            };
            glm::vec3 residual = system.residual(e);
            for (int step = 0; step < 60; ++step) {
                const StepReport report = iteration.step(bounce);
                const glm::vec3 then = system.residual(e);
                for (int k = 0; k < 3; ++k) {
                    ASSERT_FLOAT_EQ(report.residual[k], residual[k]) << seed;
                    ASSERT_LE(then[k], system.rho_max[k] * residual[k] + kRounding * bound[k])
                        << "system " << seed << ", step " << step << ", " << columns << " columns";
                }
                residual = then;
                for (const glm::vec4& value : e) {
                    for (int k = 0; k < 3; ++k) {
                        ASSERT_GE(value[k], 0.0f) << seed;
                        ASSERT_LE(value[k], bound[k] * (1.0f + kRounding)) << seed;
                    }
                }
            }
        }
    }
}

// From any start, such as the light of another scene a thousand times as bright.
TEST(FixedPoint, ShrinksTheResidualFromAnyStart) {
    Pool pool(1);
    for (std::uint32_t seed = 1; seed <= 200; ++seed) {
        const System system = random_system(seed);
        std::mt19937 random(seed);
        std::vector<glm::vec4> e;
        for (std::size_t i = 0; i < system.n; ++i)
            e.emplace_back(glm::vec3(std::uniform_real_distribution<float>(0.0f, 1e5f)(random)), 0.0f);
        FixedPoint iteration(e, glm::vec3(std::numeric_limits<float>::infinity()), 2, pool);
        glm::vec3 residual = system.residual(e);
        for (int step = 0; step < 40; ++step) {
            iteration.step(
                [&](std::span<const glm::vec4> from, std::vector<glm::vec4>& to) { system.bounce(from, to); });
            const glm::vec3 then = system.residual(e);
            for (int k = 0; k < 3; ++k)
                ASSERT_LE(then[k], system.rho_max[k] * residual[k] + 1e5f * kRounding) << seed << " " << step;
            residual = then;
        }
    }
}

// What it is after 40 bounces, against elimination; and acceleration is worth it.
TEST(FixedPoint, ComesToTheSolution) {
    Pool pool(1);
    double off[5] = {};
    for (std::uint32_t seed = 1; seed <= 100; ++seed) {
        const System system = random_system(seed);
        const std::vector<glm::dvec3> exact = system.exact();
        for (const unsigned columns : {0u, 1u, 2u, 4u}) {
            std::vector<glm::vec4> e = system.s;
            FixedPoint iteration(e, system.s_max / (1.0f - system.rho_max), columns, pool);
            for (int step = 0; step < 40; ++step)
                iteration.step(
                    [&](std::span<const glm::vec4> from, std::vector<glm::vec4>& to) { system.bounce(from, to); });
            double most = 0.0, greatest = 0.0;
            for (std::size_t i = 0; i < system.n; ++i) {
                most = std::max(most, std::abs(static_cast<double>(e[i].b) - exact[i].b));
                greatest = std::max(greatest, exact[i].b);
            }
            off[columns] += greatest > 0.0 ? most / greatest / 100.0 : 0.0;
        }
    }
    std::printf("off by, after 40 bounces: plain %.4f, 1 column %.4f, 2 columns %.5f, 4 columns %.6f\n", off[0], off[1],
                off[2], off[4]);
    EXPECT_LT(off[2], 0.2 * off[0]);
    EXPECT_LT(off[2], 0.01);
}

TEST(FixedPoint, DarknessStaysDark) {
    Pool pool(1);
    System system = random_system(7);
    for (glm::vec4& s : system.s) s = glm::vec4(0.0f);
    std::vector<glm::vec4> e = system.s;
    FixedPoint iteration(e, glm::vec3(0.0f), 2, pool);
    for (int step = 0; step < 5; ++step) {
        const StepReport report = iteration.step(
            [&](std::span<const glm::vec4> from, std::vector<glm::vec4>& to) { system.bounce(from, to); });
        EXPECT_EQ(report.residual, glm::vec3(0.0f));
        EXPECT_EQ(report.relative, 0.0f);
    }
    for (const glm::vec4& value : e) EXPECT_EQ(value, glm::vec4(0.0f));
}

}  // namespace
}  // namespace gonio::transport
