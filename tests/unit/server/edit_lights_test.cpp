// Many lights at once, lights that are like another, and the work light: apply(), undo, revisions and the saved show.
#include "protocol/schema/command.pb.h"
#include "protocol/schema/light.pb.h"
#include "server/scene/limits.h"
#include "server/scene/scene.h"
#include "tests/unit/server/undo_fixture.h"

namespace gonio::undo_test {
namespace {

v1::Command edit(const std::function<void(v1::EditLights&)>& fill) {
    return command_of([&](v1::Command& c) { fill(*c.mutable_edit_lights()); });
}
void set_x(v1::EditLights& edit, const std::string& name, double x) {
    v1::SetLight& set = *edit.add_set();
    set.set_name(name);
    for (const double value : {x, 2.0, 0.0}) set.add_position_m(value);
}
void add_like(v1::EditLights& edit, const std::string& name, const std::string& like) {
    v1::AddLight& add = *edit.add_add();
    add.mutable_light()->set_name(name);
    add.set_like(like);
}

class EditLights : public UndoTest {};

TEST_F(EditLights, EachHasItsOwnValuesAndAllHaveTheSameOnes) {
    const Revision before = scene().scene_rev;
    ASSERT_EQ(say(kAnn, group("wash", {"fill", "back"})), "ok");
    ASSERT_EQ(say(kAnn, edit([](v1::EditLights& e) {
                      set_x(e, "key", -1);
                      set_x(e, "fill", 1);
                      e.add_names("wash");
                      e.mutable_same()->set_level_ratio(0.25);
                  })),
              "ok");
    EXPECT_EQ(scene().scene_rev, before + 2) << "one revision";
    EXPECT_EQ(light("key").position.x, -1);
    EXPECT_EQ(light("fill").position.x, 1);
    EXPECT_EQ(light("key").level_ratio, 1);
    EXPECT_EQ(light("fill").level_ratio, 0.25);
    EXPECT_EQ(light("back").level_ratio, 0.25);
    EXPECT_EQ(labels[kAnn].undo_label(), "level and position of 3 lights") << "two of their own, and a group";
}

TEST_F(EditLights, IsOneStepOfUndo) {
    expect_there_and_back({edit([](v1::EditLights& e) {
                               set_x(e, "key", -1);
                               set_x(e, "back", 1);
                           }),
                           edit([](v1::EditLights& e) {
                               e.add_names("key");
                               e.add_names("back");
                               e.mutable_same()->set_tint_duv(0.01);
                           }),
                           edit([](v1::EditLights& e) {
                               add_like(e, "key 2", "key");
                               add_like(e, "key 3", "key");
                           }),
                           edit([](v1::EditLights& e) {
                               e.add_remove("key 2");
                               e.add_remove("fill");
                           })});
    EXPECT_EQ(labels[kAnn].undo_label(), "remove 2 lights");
}

TEST_F(EditLights, ChangesAllOrNothing) {
    const std::string before = text();
    const struct {
        std::function<void(v1::EditLights&)> more;
        const char *code, *field, *value;
    } cases[] = {
        {[](v1::EditLights& e) { set_x(e, "none", 0); }, "not_found", "edit_lights.set.name", "none"},
        {[](v1::EditLights& e) { set_x(e, "back", 1e9); }, "invalid_argument", "edit_lights.set.position_m",
         "1000000000,2,0"},
        {[](v1::EditLights& e) { e.add_names("none"); }, "not_found", "edit_lights.names", "none"},
        {[](v1::EditLights& e) { e.add_remove("none"); }, "not_found", "edit_lights.remove", "none"},
        {[](v1::EditLights& e) { add_like(e, "back", "key"); }, "already_exists", "edit_lights.add.light.name", "back"},
        {[](v1::EditLights& e) { add_like(e, "new", "none"); }, "not_found", "edit_lights.add.like", "none"},
        {[](v1::EditLights& e) { e.mutable_set(0)->mutable_profile()->set_name("flood"); }, "unsupported",
         "edit_lights.set.profile", "key"},
        {[](v1::EditLights& e) {
             for (std::size_t i = 0; i <= kMaxLights; ++i) e.add_names("key");
         },
         "too_large", "edit_lights.names", "1025"},
    };
    for (const auto& wrong : cases) {
        EXPECT_EQ(say(kAnn, edit([&](v1::EditLights& e) {
                          set_x(e, "key", -1);
                          wrong.more(e);
                      })),
                  wrong.code);
        EXPECT_EQ(reply.result().field(), wrong.field);
        EXPECT_EQ(reply.result().value(), wrong.value);
        EXPECT_EQ(difference(text(), before), "");
    }
}

TEST_F(EditLights, OthersSeeConflicts) {
    const Revision before = scene().scene_rev;
    v1::Command both = edit([](v1::EditLights& e) {
        e.add_names("key");
        e.add_names("fill");
        e.mutable_same()->set_level_ratio(0.5);
    });
    ASSERT_EQ(say(kAnn, both), "ok");
    v1::Command bobs = level("fill", 0.7);
    bobs.set_base_rev(before);
    EXPECT_EQ(say(kBob, bobs), "conflict");
    EXPECT_EQ(reply.result().field(), "lights.fill.level_ratio");
    ASSERT_EQ(say(kBob, level("key", 0.9)), "ok");
    ASSERT_EQ(undo(kAnn), "ok");
    EXPECT_EQ(light("key").level_ratio, 0.9) << "Bob's stays";
    EXPECT_EQ(light("fill").level_ratio, 1);
}

TEST_F(EditLights, ALightLikeAnotherHasAllThatItHas) {
    ASSERT_EQ(say(kAnn, level("key", 0.3)), "ok");
    ASSERT_EQ(say(kAnn, pan("key", 0.4)), "ok");
    v1::Command add = undo_test::add("copy");
    add.mutable_add_light()->set_like("key");
    add.mutable_add_light()->set_multiplier(2.5);
    add.mutable_add_light()->mutable_light()->set_tint_duv(-0.02);
    Work work;  // without a profile: nothing has to be read
    work.session = kAnn;
    work.message.set_request_id(9);
    *work.message.mutable_command() = add;
    stage->take(std::move(work));
    ASSERT_EQ(reply.result().code(), "ok");
    const Light &copy = light("copy"), &key = light("key");
    EXPECT_EQ(copy.profile, key.profile);
    EXPECT_EQ(copy.level_ratio, 0.3);
    EXPECT_EQ(copy.world_from_light, key.world_from_light);
    EXPECT_EQ(copy.position, key.position);
    EXPECT_EQ(copy.tint_duv, -0.02);
    EXPECT_EQ(copy.multiplier, 2.5);
    EXPECT_NE(copy.id, key.id);
    const saved::Show show = show_of(scene(), texts);
    const RestoredShow again = restore_show(show, asset, true);
    EXPECT_TRUE(again.warnings.empty());
    EXPECT_EQ(find_light(again.scene, "copy")->multiplier, 2.5) << "also after a restart";
    EXPECT_EQ(find_light(again.scene, "key")->multiplier, 1);
}

TEST_F(EditLights, TheWorkLightIsWhereNothingElseIs) {
    const auto work_light = [](bool on) {
        return command_of([&](v1::Command& c) { c.mutable_set_view()->set_work_light(on); });
    };
    EXPECT_FALSE(work_light_on(scene()));
    ASSERT_EQ(say(kAnn, edit([](v1::EditLights& e) {
                      for (const char* name : {"key", "fill", "back"}) e.add_remove(name);
                  })),
              "ok");
    EXPECT_TRUE(work_light_on(scene()));
    EXPECT_TRUE(changes.back().state().work_light_on());
    EXPECT_EQ(say(kAnn, work_light(false)), "ok");
    EXPECT_FALSE(work_light_on(scene()));
    EXPECT_FALSE(work_light_on(restore_show(show_of(scene(), texts), asset, true).scene)) << "also after a restart";
    EXPECT_EQ(say(kAnn, work_light(true)), "ok");
    EXPECT_EQ(say(kAnn, command_of([](v1::Command& c) { c.mutable_set_view()->set_view("illuminance"); })), "ok");
    EXPECT_FALSE(work_light_on(scene())) << "of lux there are none";
    EXPECT_EQ(say(kAnn, command_of([](v1::Command& c) { c.mutable_set_view()->set_view("beauty"); })), "ok");
    EXPECT_TRUE(work_light_on(scene()));
    ASSERT_EQ(undo(kAnn), "ok");
    EXPECT_FALSE(work_light_on(scene())) << "lights are there again";
    EXPECT_FALSE(changes.back().state().work_light_on());
}

}  // namespace
}  // namespace gonio::undo_test
