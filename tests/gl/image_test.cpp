// The live picture at the default setting, still and moving, against the reference quality (every pixel a grid point
// and a shadow ray), by what an eye sees of the difference (flip.h): below a bound that frames with a fault exceed.
#include <algorithm>
#include <cmath>
#include <functional>

#include "server/assets/assets.h"
#include "server/scene/apply.h"
#include "tests/gl/flip.h"
#include "tests/gl/test_context.h"

namespace gonio::test {
namespace {

constexpr int kSide = 800;

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

// What is shown, and the same scene in reference quality.
Picture shown_of(Renderer& renderer, const Scene& scene) {
    renderer.begin_frame(scene, monotonic_ns());
    const FinishedFrame frame = *renderer.finish_frame(true);
    return picture_of_nv12(*frame.nv12, frame.width_px, frame.height_px);
}
Picture reference_of(Renderer& renderer, const Scene& scene) {
    return picture_of_rgba(renderer.capture(scene, scene.view, kSide, kSide, false)->rgba8, kSide, kSide);
}

// Mean FLIP of the whole picture and of its indirect light alone.
struct Bounds {
    double beauty, indirect;
};

// A session as a viewer has it: one renderer, the picture at the default setting.
class Session {
public:
    Session(const std::shared_ptr<const SceneAsset>& asset) : home(scene_of(asset)) {
        home.camera.eye += glm::dvec3(0.013, 0.007, 0.0);  // else edges run through the centres of pixels
        home.width_px = home.height_px = kSide;
    }
    // The camera turned about its target, the luminaire shifted.
    Scene moved(double turn_rad, double shift_m) const {
        Scene scene = home;
        const glm::dvec3 from = home.camera.eye - home.camera.target;
        const double c = std::cos(turn_rad), s = std::sin(turn_rad);
        scene.camera.eye = home.camera.target + glm::dvec3(c * from.x + s * from.z, from.y, c * from.z - s * from.x);
        scene.lights[0].position.x += shift_m;
        return scene;
    }
    Picture live(const Scene& scene, View view) { return shown_of(renderer_, stamped(scene, view)); }
    Picture reference(const Scene& scene, View view) { return reference_of(renderer_, stamped(scene, view)); }
    // Without occlusion.
    Picture bare(const Scene& scene, View view) {
        Renderer renderer(context(), Renderer::Gather::simd);
        renderer.set_occluded(false);
        return shown_of(renderer, stamped(scene, view));
    }

    Scene home;

private:
    Scene stamped(Scene scene, View view) {
        scene.view = view;
        scene.camera_rev = scene.lights[0].position_rev = scene.view_rev = scene.scene_rev = ++revision_;
        return scene;
    }

    Renderer renderer_{context(), Renderer::Gather::simd};
    Revision revision_ = 1;
};

void looks_right(const std::shared_ptr<const SceneAsset>& asset, const Bounds& bounds) {
    Session session(asset);
    for (const View view : {View::beauty, View::indirect}) {
        const double bound = view == View::beauty ? bounds.beauty : bounds.indirect;
        const Picture truth = session.reference(session.home, view);
        EXPECT_LT(mean_flip(truth, session.live(session.home, view)), bound) << "still, " << view_name(view);
        // The bounds are tight: what is wrong is seen.
        Scene few = session.home;
        few.samples = 256;
        EXPECT_GT(mean_flip(truth, session.live(few, view)), bound) << "256 VPLs, " << view_name(view);
        EXPECT_GT(mean_flip(truth, session.live(session.moved(0.0, 0.05), view)), bound)
            << "the luminaire 5 cm off, " << view_name(view);
        EXPECT_GT(mean_flip(truth, session.bare(session.home, view)), bound) << "unoccluded, " << view_name(view);
    }
    // An orbit, then a move of the luminaire: every fourth frame is looked at.
    const View view = View::beauty;
    for (int n = 1; n <= 16; ++n) {
        const Scene scene = session.moved(0.02 * std::min(n, 8), 0.03 * std::max(0, n - 8));
        const Picture live = session.live(scene, view);
        if (n % 4 == 0) {
            EXPECT_LT(mean_flip(session.reference(scene, view), live), bounds.beauty) << "frame " << n;
        }
    }
}

TEST(Image, Cornell) {
    looks_right(make_cornell(), {0.045, 0.047});
}

TEST(Image, Atrium) {
    looks_right(make_atrium(), {0.072, 0.082});
}

}  // namespace
}  // namespace gonio::test
