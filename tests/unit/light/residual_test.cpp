// What a bounce changes is the same by vectors as value by value, and light that is not a number is not overlooked.
#include "server/transport/residual.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

namespace gonio::transport {
namespace {

TEST(Residual, IsWhatItsParagraphSays) {
    std::mt19937 random(7);
    std::uniform_real_distribution<float> number(0.0f, 2.0f);
    std::vector<glm::vec4> e(1001), f(e.size()), r(e.size());
    for (auto* values : {&e, &f})
        for (glm::vec4& value : *values)
            for (int k = 0; k < 4; ++k) value[k] = number(random);
    const glm::vec3 floor(0.5f, 0.25f, 1e-3f);
    const Residual found = compare(e, f, floor, r);
    for (int k = 0; k < 3; ++k) {
        float most = 0.0f, greatest = 0.0f, relative = 0.0f;
        double change = 0.0, sum = 0.0;
        for (std::size_t i = 0; i < e.size(); ++i) {
            EXPECT_EQ(r[i][k], f[i][k] - e[i][k]);
            const float off = std::abs(f[i][k] - e[i][k]);
            most = std::max(most, off);
            greatest = std::max(greatest, f[i][k]);
            relative = std::max(relative, off / (f[i][k] + floor[k]));
            change += static_cast<double>(off), sum += static_cast<double>(f[i][k]);
        }
        EXPECT_EQ(found.most[k], most);
        EXPECT_EQ(found.greatest[k], greatest);
        EXPECT_NEAR(found.relative[k], relative, 1e-6f * relative);
        EXPECT_NEAR(found.change[k], change, 1e-4 * change);
        EXPECT_NEAR(found.sum[k], sum, 1e-4 * sum);
    }
}

TEST(Residual, KeepsWhatIsNotANumber) {
    for (const std::size_t at : {0u, 3u, 6u}) {
        std::vector<glm::vec4> e(7, glm::vec4(1.0f)), f = e, r(e.size());
        f[at].g = std::numeric_limits<float>::quiet_NaN();
        const Residual found = compare(e, f, glm::vec3(0.1f), r);
        EXPECT_TRUE(std::isnan(found.relative.g)) << at;
        EXPECT_TRUE(std::isnan(found.most.g)) << at;
        EXPECT_EQ(found.relative.r, 0.0f);
    }
}

}  // namespace
}  // namespace gonio::transport
