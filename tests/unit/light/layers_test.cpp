// Sums of luminaires' layers: whatever was kept from earlier pictures, the same terms give the same sum.
#include <gtest/gtest.h>

#include <glm/gtc/packing.hpp>
#include <map>
#include <random>

#include "server/lighting/layers.h"

namespace gonio::lighting {
namespace {

constexpr std::size_t kLights = 20, kPixels = 128, kPoints = 64;

class Layers : public testing::Test {
protected:
    Layers() : layers(kLights), weights(kLights, glm::vec3(1000.0f)) {
        for (std::size_t i = 0; i < kLights; ++i) renew(i);
    }
    void renew(std::size_t light) {
        std::uniform_real_distribution<float> uniform(0.0f, 3.0f);
        LightLayer& layer = layers[light];
        layer.direct.resize(kPixels);
        for (auto& value : layer.direct) value = glm::packHalf1x16(uniform(random));
        for (auto& plane : layer.indirect) {
            plane.resize(kPoints);
            for (auto& value : plane) value = glm::packHalf1x16(uniform(random));
        }
        layer.gathered.clear();  // now and then it is
        if (uniform(random) < 1.0f) layer.gathered.resize(4 * kPixels);
        for (auto& value : layer.gathered) value = glm::packHalf1x16(uniform(random));
        version[light] = ++versions;
    }
    std::vector<LayerTerm> terms() const {
        std::vector<LayerTerm> result;
        for (std::size_t i = 0; i < kLights; ++i) {
            if (weights[i] != glm::vec3(0.0f))
                result.push_back(
                    {{version.at(i), weights[i], direct, indirect}, static_cast<std::uint32_t>(i + 1), &layers[i]});
        }
        return result;
    }
    // All of a sum: at the pixels three channels, then on the grid.
    std::vector<float> values(LayerSum& of) {
        of.take(terms(), kLights, kPixels, kPoints, pool);
        others = of.others().size();
        std::vector<float> all;
        for (int k = 0; k < 3; ++k) {
            for (std::size_t p = 0; p < kPixels; ++p) {
                std::int32_t total = of.kept_pixels(k) != nullptr ? of.kept_pixels(k)[p] : 0;
                const auto add = [&](std::uint16_t half, float steps) {
                    total += static_cast<std::int32_t>(
                        std::nearbyint(std::min(glm::unpackHalf1x16(half) * steps, of.cap())));
                };
                for (const LayerTerm& term : of.others()) {
                    const auto channel = static_cast<std::size_t>(k);
                    if (term.direct_pixels() != nullptr) add(term.direct_pixels()[p], term.steps[k]);
                    if (term.indirect_pixels() != nullptr) add(term.indirect_pixels()[4 * p + channel], term.steps[k]);
                }
                all.push_back(static_cast<float>(total));
            }
        }
        Planes planes(3, std::vector<float>(kPoints));
        of.grid(1.0f, planes, pool);
        for (const auto& plane : planes) all.insert(all.end(), plane.begin(), plane.end());
        return all;
    }
    void expect_as_fresh(const char* after) {
        LayerSum fresh;
        const auto wanted = values(fresh);
        ASSERT_EQ(values(sum), wanted) << after;
    }

    std::mt19937 random{7};
    std::uint64_t versions = 0;
    std::map<std::size_t, std::uint64_t> version;  // of each layer
    std::vector<LightLayer> layers;
    std::vector<glm::vec3> weights;
    std::size_t others = 0;
    bool direct = true, indirect = true;  // are shown
    LayerSum sum;
    Pool pool;
};

TEST_F(Layers, RidingOneReadsFewOthers) {
    expect_as_fresh("the first picture");
    for (int i = 0; i < 5; ++i) {
        weights[3] = glm::vec3(100.0f * static_cast<float>(i));
        expect_as_fresh("a level");
        EXPECT_LE(others, 1u) << i;
    }
    renew(3);
    expect_as_fresh("a layer");
}

TEST_F(Layers, NoHistoryShows) {
    std::uniform_int_distribution<std::size_t> pick(0, kLights - 1);
    for (int picture = 0; picture < 300; ++picture) {
        const std::size_t light = pick(random) % (1 + static_cast<std::size_t>(picture) / 20);
        if (picture % 11 == 0) direct = !direct || !indirect;
        if (picture % 13 == 0) indirect = !indirect || !direct;
        switch (picture % 7) {
            case 0:
                renew(light);
                break;
            case 1:
                weights[light] = glm::vec3(0.0f);
                break;
            case 2:
                for (glm::vec3& weight : weights) weight *= 0.99f;
                break;
            default:
                weights[light] = glm::vec3(500.0f, 900.5f, 0.25f * static_cast<float>(picture));
        }
        expect_as_fresh("a change");
    }
}

// Far beyond what is shown, terms are bounded; nothing overflows.
TEST_F(Layers, GreatTermsAreBounded) {
    weights.assign(kLights, glm::vec3(1e30f));
    expect_as_fresh("a million suns");
    LayerSum fresh;
    for (const float value : values(fresh)) {
        EXPECT_GE(value, 0.0f);
        EXPECT_LT(value, 0x1p31f);
    }
}

TEST_F(Layers, AnUnchangedPictureIsNoChange) {
    values(sum);
    const std::uint64_t changes = sum.changes();
    values(sum);
    EXPECT_EQ(sum.changes(), changes);
    weights[0] *= 0.5f;
    values(sum);
    EXPECT_NE(sum.changes(), changes);
}

}  // namespace
}  // namespace gonio::lighting
