// The live picture at the default setting, still and moving, against the path tracer in windows of it, by
// what an eye sees of the difference (flip.h): below a bound that frames with a fault exceed.
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "server/scene/apply.h"
#include "server/scene/scene.h"
#include "tests/gl/flip.h"
#include "tests/gl/look_session.h"
#include "tests/gl/test_context.h"

namespace gonio::test {
namespace {

Picture flat(const glm::vec3& srgb) {
    return {64, 64, std::vector<glm::vec3>(64 * 64, srgb)};
}

TEST(Flip, SameColourAndOppositeColours) {
    EXPECT_EQ(mean_flip(flat({0.2f, 0.5f, 0.9f}), flat({0.2f, 0.5f, 0.9f})), 0.0);
    // By definition.
    EXPECT_NEAR(mean_flip(flat({0, 1, 0}), flat({0, 0, 1})), 1.0, 1e-3);
    // L* 100 against 0, without chroma: 100^0.7 = 25.12, over a greatest difference of 41.27 whose 40 % count 95 %.
    EXPECT_NEAR(mean_flip(flat(glm::vec3(0)), flat(glm::vec3(1))), 0.95 + 0.05 * (25.12 - 16.51) / (41.27 - 16.51),
                1e-3);
    // L* of 8-bit greys 118 and 119 is 49.5 and 49.9 (CIE 15): 0.39^0.7 of 16.51 counts 95 %.
    EXPECT_NEAR(mean_flip(flat(glm::vec3(118 / 255.0f)), flat(glm::vec3(119 / 255.0f))), 0.95 * 0.52 / 16.51, 2e-3);
}

TEST(Flip, FinePatternsVanishAndEdgesCount) {
    // A chequerboard of single pixels looks grey at 67 pixels a degree but for what one contrast channel leaves of it:
    // far less than black against white; seen from a tenth of the distance it does not.
    Picture board = flat(glm::vec3(0)), inverse = board;
    for (int i = 0; i < 64 * 64; ++i) {
        board.srgb[static_cast<std::size_t>(i)] = glm::vec3(static_cast<float>((i % 64 + i / 64) % 2));
        inverse.srgb[static_cast<std::size_t>(i)] = glm::vec3(1.0f) - board.srgb[static_cast<std::size_t>(i)];
    }
    const auto middle = [](const std::vector<float>& map) { return map[32 * 64 + 32]; };
    EXPECT_LT(middle(flip(board, inverse)), 0.05f);
    EXPECT_GT(middle(flip(board, inverse, 2.0f)), 0.9f);
    // A step of lightness by a hundredth: at the step its edge adds to the difference of colours further off.
    Picture step = flat(glm::vec3(0.5f));
    for (int i = 0; i < 64 * 64; ++i) {
        if (i % 64 >= 32) step.srgb[static_cast<std::size_t>(i)] = glm::vec3(0.55f);
    }
    const std::vector<float> map = flip(flat(glm::vec3(0.55f)), step);
    EXPECT_GT(map[32 * 64 + 31], 0.0f);
    EXPECT_NEAR(map[32 * 64 + 60], 0.0f, 1e-4f);
    EXPECT_GT(map[32 * 64 + 29], map[32 * 64 + 5]) << "beside the edge more than far from it";
}

// Mean FLIP over windows of the picture.
double off_by(const std::vector<Traced>& truth, const Picture& live, const Scene& scene, View view) {
    double sum = 0.0;
    for (const Traced& traced : truth)
        sum += mean_flip(shown_of(traced, traced.indirect_lx, scene, view), part_of(live, traced.window));
    return sum / static_cast<double>(truth.size());
}
// What the truth's own noise counts: halves of its samples against each other; the mean of both is off by less.
double noise_of(const std::vector<Traced>& truth, const Scene& scene, View view) {
    double sum = 0.0;
    for (const Traced& traced : truth)
        sum += mean_flip(shown_of(traced, traced.half_lx[0], scene, view),
                         shown_of(traced, traced.half_lx[1], scene, view));
    return sum / static_cast<double>(truth.size());
}

// Of the still picture and of two windows with small parts while it moves.
struct Bounds {
    double beauty, indirect, moving_beauty, moving_indirect;
    double aside_m;  // so much of a shift of the luminaire is seen
};

TEST_P(Look, IsRight) {
    const std::string name = GetParam();
    const Bounds bounds =
        name == "cornell" ? Bounds{0.07, 0.07, 0.075, 0.075, 0.15} : Bounds{0.1, 0.1, 0.11, 0.12, 0.2};
    const Scene& home = session.home;
    for (const View view : {View::beauty, View::indirect}) {
        const auto off = [&](const Picture& live) { return off_by(truth, live, home, view); };
        const double still = off(session.live(home, view)),
                     aside = off(session.live(session.moved(0.0, bounds.aside_m), view)),
                     bare = off(session.live(home, View::direct));
        std::printf("%s, %s: FLIP %.4f; luminaire %.2f m off %.4f, direct light alone %.4f; noise %.4f\n", name.c_str(),
                    view_name(view), still, bounds.aside_m, aside, bare, noise_of(truth, home, view));
        const double bound = view == View::beauty ? bounds.beauty : bounds.indirect;
        EXPECT_LT(still, bound) << view_name(view);
        // The bounds are tight: what is wrong is seen.
        EXPECT_GT(bare, bound) << view_name(view);
        if (view == View::beauty) {
            EXPECT_GT(aside, bound);
        }
    }
    // The last frames of an orbit and of a move of the luminaire; the one four frames older is too old.
    for (const bool orbit : {true, false}) {
        constexpr int kFrames = 5;
        const auto scene_at = [&](int n) {
            return orbit ? session.moved(0.02 * n, 0.0) : session.moved(0.02 * kFrames, bounds.aside_m * n);
        };
        const Scene last = scene_at(kFrames);
        const std::vector<Traced> moved_truth = session.traced(last, 1, 2);
        for (const View view : {View::beauty, View::indirect}) {
            double off = 0.0, older = 0.0;
            for (int n = 1; n <= kFrames; ++n) {
                const Picture live = session.live(scene_at(n), view);
                if (n == kFrames - 4) older = off_by(moved_truth, live, last, view);
                if (n == kFrames) off = off_by(moved_truth, live, last, view);
            }
            std::printf("%s, %s, %s: FLIP %.4f; four frames late %.4f; noise %.4f\n", name.c_str(), view_name(view),
                        orbit ? "orbit" : "luminaire moves", off, older, noise_of(moved_truth, last, view));
            const double bound = view == View::beauty ? bounds.moving_beauty : bounds.moving_indirect;
            EXPECT_LT(off, bound) << (orbit ? "orbit, " : "luminaire, ") << view_name(view);
            if (orbit || view == View::beauty) {
                EXPECT_GT(older, bound) << (orbit ? "orbit" : "luminaire");
            }
        }
    }
}

}  // namespace
}  // namespace gonio::test
