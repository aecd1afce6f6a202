// False-colour pictures against the float values of the same pixels.
#include "server/scene/false_color.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>

#include "protocol/schema/command.pb.h"
#include "protocol/schema/report.pb.h"
#include "protocol/schema/view.pb.h"
#include "server/scene/scene.h"
#include "server/session/legend.h"
#include "server/trace/geometry.h"
#include "tests/gl/test_context.h"

namespace gonio::test {
namespace {

constexpr int kWidth_px = 120, kHeight_px = 96;

class FalseColors : public testing::Test {
protected:
    FalseColors() : renderer(context(), direct_light()), scene(scene_of(builtin("cornell"))) {
        make_coarse(renderer);
        scene.view = View::illuminance;
        settings().logarithmic = false;
        settings().range_low = 0.0;
        settings().range_high = 160.0;
    }
    FalseColor& settings() { return scene.false_color[0]; }
    // Direct light at the centres of pixels: the same in both kinds, but for half floats.
    std::shared_ptr<const CapturedPicture> capture(bool raw, int bounces = 0) {
        return renderer.capture(scene, scene.view, kWidth_px, kHeight_px, raw, bounces, 1);
    }
    // Of a pixel that shows a surface: its index, lux, and R'G'B'.
    void each(const CapturedPicture& lux, const CapturedPicture& shown,
              const std::function<void(std::size_t, float, const glm::ivec3&)>& visit) {
        std::size_t seen = 0;
        for (std::size_t i = 0; i < lux.values.size(); i += 4) {
            if (!(lux.values[i + 3] > 0.0f)) continue;
            visit(i / 4, lux.values[i], glm::ivec3(shown.rgba8[i], shown.rgba8[i + 1], shown.rgba8[i + 2]));
            ++seen;
        }
        EXPECT_GT(seen, std::size_t{kWidth_px * kHeight_px / 4});
    }
    static bool near(double a, double b) { return std::abs(a - b) < 0.003 * b + 1e-3; }
    void apply_to(const std::function<void(v1::Command&)>& fill) {
        v1::Command command;
        fill(command);
        const auto done = apply(scene, command, {});
        ASSERT_TRUE(done) << done.error().text();
    }
    Renderer renderer;
    Scene scene;
};

// A GPU may round to 8 bits by 0.6 of a step: 18.55 is 18 on an H200.
int off(const glm::ivec3& a, const glm::vec3& b) {
    const glm::vec3 d = glm::abs(glm::vec3(a) - 255.0f * b);
    return static_cast<int>(std::ceil(std::max({d.x, d.y, d.z}) - 0.61f));
}

// Colours decode back to lux: the step whose colour a pixel has is the one that its lux lie in.
TEST_F(FalseColors, PixelsDecodeToTheirLux) {
    for (const char* palette : {"classic", "viridis", "spectral", "gray"}) {
        settings().palette = palette;
        settings().steps = 10;
        const auto lux = capture(true), shown = capture(false);
        const layouts::FalseColorBlock block = color_block(settings(), false);
        std::size_t over = 0;
        each(*lux, *shown, [&](std::size_t i, float value, const glm::ivec3& color) {
            if (value > 160.5f) {
                ++over;
                EXPECT_LE(off(color, glm::vec3(block.over)), 0) << i;
                return;
            }
            int best = 0, least = 1000;
            for (int step = 0; step < 10; ++step) {
                const int far = off(color, false_color(block, 16.0f * (static_cast<float>(step) + 0.5f)));
                if (far < least) least = far, best = step;
            }
            if (value > 159.5f) return;
            EXPECT_EQ(least, 0) << palette << " " << i;
            const int own = static_cast<int>(value / 16.0f);
            const float border = 16.0f * std::round(value / 16.0f);
            EXPECT_TRUE(best == own || near(value, border)) << palette << " " << value << " lx shown as step " << best;
        });
        EXPECT_GT(over, 0u) << "under the lamp";
    }
    // Smooth and logarithmic.
    settings() = {};
    settings().palette = "viridis";
    const auto lux = capture(true), shown = capture(false);
    const layouts::FalseColorBlock block = color_block(settings(), false);
    each(*lux, *shown, [&](std::size_t i, float value, const glm::ivec3& color) {
        if (value < 1.01f || value > 9900.0f) return;
        EXPECT_LE(off(color, false_color(block, value)), 1) << i << " " << value;
    });
}

// A line is where the pixel and its neighbour on the right or above lie on two sides of a level, and nowhere else.
TEST_F(FalseColors, LinesSeparateWhatTheyShould) {
    settings().isolux = true;
    settings().steps = 8;
    settings().range_high = 200.0;
    const auto lux = capture(true), shown = capture(false);
    const std::vector<double> levels = isolux_levels(settings(), false);
    ASSERT_EQ(levels.size(), 7u);
    const auto value = [&](int x, int y) {
        return static_cast<double>(lux->values[4 * static_cast<std::size_t>(y * kWidth_px + x)]);
    };
    const auto covered = [&](int x, int y) {
        return lux->values[4 * static_cast<std::size_t>(y * kWidth_px + x) + 3] > 0.0f;
    };
    const auto reached = [&](double of) {
        return static_cast<int>(std::ranges::count_if(levels, [&](double level) { return of >= level; }));
    };
    const auto unsure = [&](double of) {
        return std::ranges::any_of(levels, [&](double level) { return near(of, level); });
    };
    int lines = 0;
    for (int y = 1; y < kHeight_px; ++y) {
        for (int x = 0; x + 1 < kWidth_px; ++x) {
            if (!covered(x, y) || unsure(value(x, y))) continue;
            int expected = 0;
            bool sure = true;
            for (const auto& [nx, ny] : {std::pair(x + 1, y), std::pair(x, y - 1)}) {
                if (!covered(nx, ny)) continue;
                sure = sure && !unsure(value(nx, ny));
                if (reached(value(nx, ny)) != reached(value(x, y)))
                    expected = std::max(reached(value(nx, ny)), reached(value(x, y)));
            }
            if (!sure) continue;
            const std::uint8_t mark = shown->rgba8[4 * static_cast<std::size_t>(y * kWidth_px + x) + 3];
            EXPECT_EQ(mark == 255 ? 0 : mark, expected) << x << "," << y;
            lines += expected > 0 ? 1 : 0;
        }
    }
    EXPECT_GT(lines, 100);
}

TEST_F(FalseColors, TheThresholdMarksWhatIsBelow) {
    settings().below = 120.0;
    const auto lux = capture(true), shown = capture(false);
    const glm::vec3 mark(color_block(settings(), false).below_mark);
    int below = 0, marked = 0, unsure = 0;
    each(*lux, *shown, [&](std::size_t, float value, const glm::ivec3& color) {
        below += value < 120.0f ? 1 : 0;
        unsure += near(value, 120.0) ? 1 : 0;
        marked += off(color, mark) == 0 ? 1 : 0;
    });
    EXPECT_GT(below, 1000);
    EXPECT_NEAR(marked, below, unsure);
}

// Light is linear: what each light contributes alone sums up to all, and a difference is that of two pictures.
TEST_F(FalseColors, PartsAndDifferencesAddUp) {
    for (const std::size_t lights : {3u, 12u}) {
        scene = scene_of(builtin("cornell"));
        scene.view = View::illuminance;
        const Light first = scene.lights[0];
        repeat_light(scene, lights, [&](Light& light, std::size_t i) {
            light.position = first.position + glm::dvec3(0.3 * std::cos(double(i)), -0.2, 0.3 * std::sin(double(i)));
            light.level_ratio = 0.3 + 0.05 * static_cast<double>(i);
        });
        const auto all = capture(true);
        apply_to([](auto& c) { c.mutable_save_preset()->set_name("A"); });
        if (lights == 3) {
            std::vector<double> sum(all->values.size());
            for (const Light& light : scene.lights) {
                scene.view_only = light.name;
                const auto alone = capture(true);
                for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += static_cast<double>(alone->values[i]);
            }
            scene.view_only.clear();
            for (std::size_t i = 0; i < sum.size(); i += 4)
                ASSERT_NEAR(sum[i], static_cast<double>(all->values[i]), 1e-3 * sum[i] + 1e-3);
        }
        // One is dimmed, one moves, one goes.
        apply_to([&](auto& c) {
            c.mutable_set_light()->set_name(scene.lights[0].name);
            c.mutable_set_light()->set_level_ratio(0.1);
        });
        apply_to([&](auto& c) {
            c.mutable_set_light()->set_name(scene.lights[1].name);
            for (const double x : {0.5, 1.2, 0.4}) c.mutable_set_light()->add_position_m(x);
        });
        apply_to([&](auto& c) { c.mutable_remove_light()->set_name(scene.lights[2].name); });
        for (const int bounces : {0, trace::kAllBounces}) {
            const auto now = capture(true, bounces);
            scene.view_compare = "A";
            const auto difference = capture(true, bounces);
            scene.view_compare.clear();
            Scene then = scene;
            std::swap(then, scene);
            apply_to([](auto& c) { c.mutable_recall_preset()->set_name("A"); });
            // What was removed comes back by no recall.
            Light gone = first;
            for (const PresetLight& kept : *scene.presets.at("A"))
                if (std::ranges::find(scene.lights, kept.name, &Light::name) == scene.lights.end())
                    static_cast<LightValues&>(gone) = kept, gone.name = kept.name, gone.id = 77;
            scene.lights.push_back(gone);
            const auto before = capture(true, bounces);
            std::swap(then, scene);
            std::vector<double> off;
            double size = 0.0;
            for (std::size_t i = 0; i < now->values.size(); i += 4) {
                const auto expected = static_cast<double>(now->values[i] - before->values[i]);
                off.push_back(std::abs(static_cast<double>(difference->values[i]) - expected));
                size += expected * expected;
            }
            EXPECT_GT(size, 1.0);
            // Many are lit as one, but for a difference: at edges of shadows rays end otherwise, in one pixel of a
            // thousand.
            std::sort(off.begin(), off.end());
            const std::size_t edges = lights > 8 ? off.size() / 1000 : 0;
            const auto rms = [&](std::size_t count) {
                return std::sqrt(std::inner_product(off.begin(), off.begin() + static_cast<std::ptrdiff_t>(count),
                                                    off.begin(), 0.0) /
                                 size);
            };
            EXPECT_LT(rms(off.size() - edges), 0.001) << lights << " " << bounces << " " << off.back();
            EXPECT_LT(rms(off.size()), bounces != 0 ? 0.03 : 0.011) << lights << " " << bounces << " " << off.back();
        }
    }
}

// The figures of the live picture stand where its level is: between the lux of the pixels about them.
TEST_F(FalseColors, LiveFiguresStandOnTheirLines) {
    scene.width_px = 320;
    scene.height_px = 256;
    settings().levels = {30.0, 60.0, 90.0};
    settings().isolux = true;
    for (bool settled = false; !settled;) {
        renderer.begin_frame(scene, monotonic_ns());
        settled = renderer.finish_frame(true)->report.settled();
    }
    const CapturedPicture live = renderer.live_picture();
    ASSERT_EQ(live.width_px, 320);
    ASSERT_EQ(live.height_px, 256);
    const std::vector<LineFigure> figures = line_figures(live, scene, View::illuminance);
    EXPECT_GE(figures.size(), 4u);
    // Of the live picture: a shadow map darkens the pixels beside an edge between two walls, which captures do not.
    const std::vector<glm::vec3> direct = renderer.live_illuminance(scene, false),
                                 bounced = renderer.live_illuminance(scene, true);
    for (const LineFigure& one : figures) {
        float least = 1e9f, most = 0.0f;
        for (int y = std::max(one.y - 3, 0); y <= std::min(one.y + 3, 255); ++y) {
            for (int x = std::max(one.x - 3, 0); x <= std::min(one.x + 3, 319); ++x) {
                const auto at = static_cast<std::size_t>((255 - y) * 320 + x);
                const float value = trace::luminous(direct[at] + bounced[at]);
                least = std::min(least, value), most = std::max(most, value);
            }
        }
        EXPECT_LE(static_cast<double>(least), 1.08 * one.value) << one.x << "," << one.y;
        EXPECT_GE(static_cast<double>(most), 0.92 * one.value) << one.x << "," << one.y;
    }
}

// The live picture: a change of display runs the composite alone.
TEST_F(FalseColors, ADisplayChangeRunsTheCompositeOnly) {
    scene.width_px = kWidth_px;
    scene.height_px = kHeight_px;
    apply_to([](auto& c) { c.mutable_save_preset()->set_name("A"); });
    const auto frame = [&] {
        renderer.begin_frame(scene, monotonic_ns());
        const auto done = renderer.finish_frame(true);
        std::vector<std::string> ran;
        for (const v1::PassReport& row : done->report.passes())
            if (row.state() == "ran") ran.push_back(row.name());
        return std::pair(done->report.settled(), ran);
    };
    while (!frame().first) {
    }
    const std::vector<std::string> composite = {"composite", "nv12"};
    const auto expect_composite = [&](const char* what, const std::function<void(v1::SetView&)>& fill) {
        apply_to([&](auto& c) { fill(*c.mutable_set_view()); });
        EXPECT_EQ(frame(), std::pair(true, composite)) << what;
    };
    expect_composite("range", [](auto& s) { s.set_range_high(250); });
    expect_composite("scale", [](auto& s) { s.set_scale("log"), s.set_range_low(1); });
    expect_composite("steps", [](auto& s) { s.set_steps(7); });
    expect_composite("palette", [](auto& s) { s.set_palette("viridis"); });
    expect_composite("isolux", [](auto& s) { s.set_isolux(true); });
    expect_composite("levels", [](auto& s) { s.mutable_levels()->add_values(50); });
    expect_composite("below", [](auto& s) { s.set_below(100); });
    expect_composite("only", [&](auto& s) { s.set_only(scene.lights[0].name); });
    expect_composite("compare", [](auto& s) { s.set_compare("A"); });
    apply_to([&](auto& c) {
        c.mutable_set_light()->set_name(scene.lights[0].name);
        c.mutable_set_light()->set_level_ratio(0.5);
    });
    EXPECT_EQ(frame(), std::pair(true, composite)) << "a level, compared";
    expect_composite("no more", [](auto& s) { s.set_compare(""), s.set_only(""); });
}

}  // namespace
}  // namespace gonio::test
