// Random sequences of three clients and a console: undone in reverse order the scene is as it was; in any order no
// later value of another changes.
#include <random>

#include "protocol/schema/command.pb.h"
#include "server/scene/scene.h"
#include "tests/unit/server/undo_fixture.h"

namespace gonio {
namespace {

using namespace undo_test;

class UndoAtRandom : public UndoTest, public testing::WithParamInterface<int> {
protected:
    std::mt19937 random{static_cast<std::uint32_t>(GetParam())};
    std::size_t pick(std::size_t count) { return std::uniform_int_distribution<std::size_t>(0, count - 1)(random); }
    double ratio() { return 0.001 * static_cast<double>(pick(1001)); }
    std::string some_light() {
        if (pick(8) == 0 || scene().lights.empty()) return "l" + std::to_string(pick(4));
        return scene().lights[pick(scene().lights.size())].name;
    }
    std::string some(const char* prefix, std::size_t count) { return prefix + std::to_string(pick(count)); }
    v1::Command some_command(bool renames) {
        switch (pick(renames ? 18 : 17)) {
            case 0:
                return add(some("l", 4));
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
                return level(some("g", 3), ratio());
            case 10:
                return pan(some_light(), ratio());
            case 11: {
                v1::Command command = level(some_light(), ratio());
                for (int i = 0; i < 3; ++i) command.mutable_set_light()->add_position_m(ratio());
                for (int i = 0; i < 3; ++i) command.mutable_set_light()->add_aim(0.1 + ratio());
                return command;
            }
            case 12: {
                v1::Command command = level(some_light(), ratio());
                command.mutable_set_light()->set_cct_k(pick(3) == 0 ? 0 : 1000 + 14'000 * ratio());
                return command;
            }
            case 13: {
                v1::Command command = recall(some("p", 3));
                if (pick(2) == 0) return command;
                command = pan(some_light(), ratio());
                command.mutable_set_light()->set_gel(pick(3) == 0 ? "" : pick(2) == 0 ? "L201" : "L204");
                return command;
            }
            case 17:
                return renaming(some_light(), some("l", 6));
            default:
                return level(some_light(), ratio());
        }
    }
    std::shared_ptr<const Profile> some_profile(const v1::Command& command) {
        return command.has_set_light() && pick(6) == 0 ? pick(2) == 0 ? another : asset->lights[0].profile : nullptr;
    }
};

TEST_P(UndoAtRandom, UndoneInReverseOrderTheSceneIsAsBeforeAndRedoneAsAfter) {
    std::vector<std::uint32_t> order;
    std::vector<std::string> before, said;
    while (order.size() < 60) {
        const v1::Command command = some_command(true);
        const std::uint32_t session = static_cast<std::uint32_t>(1 + pick(3));
        const std::string was = text();
        const Revision rev = scene().scene_rev;
        if (say(session, command, some_profile(command)) != "ok" || scene().scene_rev == rev) continue;
        order.push_back(session);
        before.push_back(was);
        said.push_back(command.ShortDebugString());
    }
    before.push_back(text());
    for (std::size_t i = order.size(); i-- > 0;) {
        ASSERT_EQ(undo(order[i]), "ok");
        ASSERT_EQ(warnings(), std::vector<std::string>{}) << "step " << i;
        ASSERT_EQ(difference(text(), before[i]), "") << "step " << i << " " << said[i];
    }
    for (const std::uint32_t session : {kAnn, kBob, kCy}) EXPECT_EQ(undo(session), "not_found");
    for (std::size_t i = 0; i < order.size(); ++i) {
        ASSERT_EQ(redo(order[i]), "ok");
        ASSERT_EQ(difference(text(), before[i + 1]), "") << "step " << i << " " << said[i];
    }
}

// Every property as text, by its name. The orientation is one, as base_rev has it.
std::map<std::string, std::string> properties_of(const Scene& scene) {
    std::map<std::string, std::string> properties;
    for (const Light& light : scene.lights) {
        const std::string path = "light " + light.name + " ";
        properties[path] = "there";
        for (const LightRow& row : light_rows()) {
            std::string& text =
                properties[path + (row.stale == &Light::aim_rev ? "aim" : std::string(row_of(row.property).name))];
            for (const double number : numbers_of(light, row)) text += std::to_string(number) + " ";
        }
        properties[path + "profile"] = light.profile->name;
        properties[path + "gel"] = light.gel ? light.gel->name : "none";
    }
    for (const auto& [name, lights] : scene.groups)
        for (const std::string& light : lights) properties["group " + name] += light + " ";
    for (const auto& [name, preset] : scene.presets)
        properties["preset " + name] = std::to_string(reinterpret_cast<std::uintptr_t>(preset.get()));
    properties["patch"] = std::to_string(reinterpret_cast<std::uintptr_t>(scene.patch.get()));
    properties["surfaces"] = std::to_string(reinterpret_cast<std::uintptr_t>(scene.surfaces.get()));
    properties["master"] = std::to_string(scene.master_ratio);
    return properties;
}

// An account of its own: of each property who wrote which value. An undo may take back the newest value alone, and its
// own alone.
TEST_P(UndoAtRandom, UndoneInAnyOrderNoLaterValueOfAnotherChanges) {
    using Account = std::map<std::string, std::vector<std::pair<std::string, std::uint32_t>>>;
    Account account;
    for (const auto& [path, value] : properties_of(scene())) account[path].emplace_back(value, 0);
    int taken_back = 0, stayed = 0;
    for (int turn = 0; turn < 300; ++turn) {
        const auto before = properties_of(scene());
        const std::uint32_t session = static_cast<std::uint32_t>(1 + pick(3));
        const std::size_t what = pick(10);
        std::uint32_t by = session;
        if (what < 3) {
            undo(session);
            stayed += reply.result().warnings_size();
        } else if (what < 4) {
            redo(session);
        } else if (what < 6) {
            by = 0;
            console(pick(2) == 0 ? level(some_light(), ratio()) : pan(some_light(), ratio()));
        } else {
            const v1::Command command = some_command(false);
            say(session, command, some_profile(command));
        }
        auto after = properties_of(scene());
        std::set<std::string> paths;
        for (const auto& [path, value] : before) paths.insert(path);
        for (const auto& [path, value] : after) paths.insert(path);
        for (const std::string& path : paths) {
            const std::string was = before.contains(path) ? before.at(path) : "", is = after[path];
            if (was == is) continue;
            auto& values = account[path];
            if (what >= 3) {
                values.emplace_back(is, by);
                continue;
            }
            ++taken_back;
            ASSERT_FALSE(values.empty()) << path;
            ASSERT_EQ(values.back().second, session) << path << " is another's, turn " << turn;
            values.pop_back();
            ASSERT_EQ(values.empty() ? "" : values.back().first, is) << path << ", turn " << turn;
        }
        for (const auto& [name, lights] : scene().groups)
            for (const std::string& light : lights) ASSERT_NE(find_light(scene(), light), nullptr) << name;
        ASSERT_TRUE(std::ranges::is_sorted(scene().lights, {}, &Light::id));
    }
    EXPECT_GT(taken_back, 20);
    EXPECT_GT(stayed, 0);
}

INSTANTIATE_TEST_SUITE_P(Seeds, UndoAtRandom, testing::Range(1, 21));

}  // namespace
}  // namespace gonio
