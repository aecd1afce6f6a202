// Whatever changes of a followed show are told of together, or left out: the follower ends with the same show.
#include <algorithm>
#include <random>

#include "protocol/schema/command.pb.h"
#include "protocol/schema/cue.pb.h"
#include "protocol/schema/gonio.pb.h"
#include "protocol/schema/grid.pb.h"
#include "protocol/schema/light.pb.h"
#include "protocol/schema/state.pb.h"
#include "protocol/schema/view.pb.h"
#include "server/scene/scene.h"
#include "tests/unit/server/follow_fixture.h"

namespace gonio {
namespace {

using namespace undo_test;

class FollowAtRandom : public Follow, public testing::WithParamInterface<int> {
protected:
    std::mt19937 random{static_cast<std::uint32_t>(GetParam())};
    std::size_t pick(std::size_t count) { return std::uniform_int_distribution<std::size_t>(0, count - 1)(random); }
    double ratio() { return 0.001 * static_cast<double>(1 + pick(1000)); }
    std::string some(const char* prefix, std::size_t count) { return prefix + std::to_string(pick(count)); }
    std::string some_light() {
        if (pick(8) == 0 || scene().lights.empty()) return some("l", 5);
        return scene().lights[pick(scene().lights.size())].name;
    }
    template <std::size_t count>
    std::string one_of(const char* const (&names)[count]) {
        return names[pick(count)];
    }
    v1::Command some_light_command() {
        v1::Command command = level(some_light(), ratio());
        v1::SetLight& set = *command.mutable_set_light();
        switch (pick(9)) {
            case 0:
                for (int i = 0; i < 3; ++i) set.add_position_m(ratio());
                break;
            case 1:
                for (int i = 0; i < 3; ++i) set.add_aim(0.1 + ratio());
                break;
            case 2:
                set.set_pan_rad(ratio());
                set.set_roll_rad(ratio());
                break;
            case 3:
                set.set_cct_k(pick(3) == 0 ? 0 : 1000 + 14'000 * ratio());
                set.set_tint_duv(0.05 * ratio());
                break;
            case 4:
                set.set_gel(pick(3) == 0 ? "" : pick(2) == 0 ? "L201" : "L204");
                break;
            case 5:
                set.set_opening(one_of({"file", "disc 0.4", "rect 1.2x0.3"}));
                break;
            case 6:
                set.set_zoom_rad(0.2 + ratio());
                set.set_strobe_hz(pick(2) == 0 ? 0.0 : 4.0);
                break;
            default:
                for (int i = 0; i < 3; ++i) set.add_color_rgb(ratio());
                set.set_shutter_ratio(ratio());
        }
        return command;
    }
    v1::Command some_view_command() {
        return command_of([&](v1::Command& c) {
            v1::SetView& view = *c.mutable_set_view();
            view.set_view(one_of({"beauty", "illuminance", "luminance", "solid", "mask"}));
            view.set_gain(0.5 + ratio());
            switch (pick(6)) {
                case 0:
                    view.set_view("illuminance");
                    view.set_scale(one_of({"log", "linear"}));
                    view.set_range_high(100 + 1000 * ratio());
                    view.set_range_low(0.1 + ratio());
                    break;
                case 1:
                    view.set_view("luminance");
                    view.set_range_auto(true);
                    view.set_steps(static_cast<unsigned>(2 + pick(8)));
                    break;
                case 2:
                    view.set_light(some_light());
                    break;
                case 3:
                    view.set_compare(pick(2) == 0 ? "" : some("p", 3));
                    break;
                case 4:
                    view.set_only(pick(2) == 0 ? "" : some_light());
                    break;
                default:
                    view.set_work_light(pick(2) == 0);
            }
        });
    }
    v1::Command some_setting() {
        return command_of([&](v1::Command& c) {
            switch (pick(6)) {
                case 0:
                    c.mutable_set_exposure()->set_ev100(10 * ratio());
                    c.mutable_set_exposure()->set_automatic(pick(4) == 0);
                    return;
                case 1:
                    c.mutable_set_haze()->set_extinction_per_m(0.1 * ratio());
                    c.mutable_set_haze()->set_g(0.5 * ratio());
                    return;
                case 2:
                    c.mutable_set_look()->set_tone(one_of({"knee", "aces", "agx"}));
                    c.mutable_set_look()->set_white_k(pick(2) == 0 ? 0 : 3000 + 3000 * ratio());
                    return;
                case 3:
                    c.mutable_set_size()->set_width_px(static_cast<unsigned>(16 + 2 * pick(50)));
                    c.mutable_set_size()->set_height_px(static_cast<unsigned>(16 + 2 * pick(50)));
                    return;
                case 4:
                    c.mutable_set_technique()->set_technique(one_of({"default", "seed"}));
                    c.mutable_set_technique()->set_samples(static_cast<unsigned>(16 + pick(400)));
                    return;
                default:
                    for (int i = 0; i < 3; ++i) c.mutable_set_camera()->add_eye_m(1 + ratio());
                    c.mutable_set_camera()->set_fov_rad(0.1 + ratio());
            }
        });
    }
    v1::Command some_cue_command() {
        const std::string number = std::to_string(1 + pick(4));
        switch (pick(7)) {
            case 0:
                return add_cue(number, ratio(), pick(2) == 0 ? "" : some("p", 3));
            case 1:
                return label_cue(number, some("label ", 9));
            case 2:
                return remove_cue(number);
            case 3:
                return go();
            case 4:
                return command_of([&](v1::Command& c) {
                    c.mutable_set_cue()->set_number(number);
                    c.mutable_set_cue()->set_record(true);
                });
            case 5:
                return command_of([&](v1::Command& c) {
                    c.mutable_cue_goto()->set_number(number);
                    c.mutable_cue_goto()->set_time_s(0);
                });
            default:
                return command_of([&](v1::Command& c) {
                    c.mutable_set_cue_options()->set_guard_s(ratio());
                    c.mutable_set_cue_options()->set_back_s(ratio());
                });
        }
    }
    v1::Command some_kept_command() {
        return command_of([&](v1::Command& c) {
            switch (pick(6)) {
                case 0:
                    c.mutable_save_view()->set_name(some("v", 3));
                    return;
                case 1:
                    c.mutable_recall_view()->set_name(some("v", 3));
                    return;
                case 2:
                    c.mutable_remove_view()->set_name(some("v", 3));
                    return;
                case 3: {
                    v1::Grid& grid = *c.mutable_set_grid()->mutable_grid();
                    grid.set_name(some("grid ", 3));
                    for (const double number : {0.0, 0.0, 0.0}) grid.add_corner_m(number);
                    for (const double number : {ratio() + 0.1, 0.0, 0.0}) grid.add_u_m(number);
                    for (const double number : {0.0, 0.0, 1.0}) grid.add_v_m(number);
                    grid.set_quantity(one_of({"horizontal", "camera", "cylindrical"}));
                    if (grid.quantity() == "camera") grid.set_view(pick(2) == 0 ? "" : some("v", 3));
                    grid.set_maintenance_factor(ratio());
                    return;
                }
                case 4:
                    c.mutable_remove_grid()->set_name(some("grid ", 3));
                    return;
                default:
                    c.mutable_load_scene()->set_file("cornell");
            }
        });
    }
    v1::Command some_command() {
        switch (pick(20)) {
            case 0:
                return add(some("l", 5));
            case 1:
                return removing(some_light());
            case 2: {
                std::vector<std::string> lights;
                for (std::size_t i = pick(4); i > 0; --i) lights.push_back(some_light());
                return group(some("g", 3), lights);
            }
            case 3:
                return master(ratio());
            case 4:
                return save(some("p", 3));
            case 5:
                return recall(some("p", 3));
            case 6:
                return remove_preset(some("p", 3));
            case 7:
                return patch(some_light(), static_cast<std::uint32_t>(1 + pick(5)));
            case 8:
                return map(some_light(), static_cast<int>(pick(5)));
            case 9:
                return renaming(some_light(), some("l", 5));
            case 10:
            case 11:
                return command_of(
                    [&](v1::Command& c) { pick(2) == 0 ? (void)c.mutable_undo() : (void)c.mutable_redo(); });
            case 12:
                return some_view_command();
            case 13:
                return some_setting();
            case 14:
            case 15:
                return some_cue_command();
            case 16:
                return some_kept_command();
            default:
                return some_light_command();
        }
    }
    std::shared_ptr<const Profile> some_profile(const v1::Command& command) {
        if (!command.has_set_light() && !command.has_add_light()) return nullptr;
        if (pick(4) != 0) return nullptr;
        const std::size_t which = pick(3);
        if (which == 0) return asset->lights[0].profile;
        auto profile = std::make_shared<Profile>(**builtin_profile(which == 1 ? "bulb" : "batwing"));
        profile->uploaded = true;
        return profile;
    }
};

TEST_P(FollowAtRandom, HoweverManyChangesComeTogetherTheShowIsTheSame) {
    int applied = 0;
    std::map<std::string, int> kinds;
    for (int step = 0; step < 400; ++step) {
        const v1::Command command = some_command();
        const Revision rev = scene().scene_rev;
        const bool ok = say(static_cast<std::uint32_t>(1 + pick(3)), command, some_profile(command)) == "ok";
        if (ok && scene().scene_rev != rev) {
            ++applied;
            ++kinds[command.GetDescriptor()->FindFieldByNumber(command.command_case())->name()];
        }
        if (pick(3) != 0) continue;  // a slow one gets several at once
        if (pick(40) == 0) follower = unheard_scene("http://leader"), known_boot.clear();  // was killed
        catch_up();
        expect_equal(std::to_string(step) + " " + command.ShortDebugString());
        if (HasFatalFailure()) return;
    }
    catch_up();
    expect_equal("at the end");
    EXPECT_GT(applied, 150);
    EXPECT_GT(kinds.size(), 18u) << "of that many kinds";
}
INSTANTIATE_TEST_SUITE_P(Seeds, FollowAtRandom, testing::Range(1, 17));

}  // namespace
}  // namespace gonio
