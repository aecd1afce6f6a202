// A leader, and a follower that makes of it what it is told.
#pragma once

#include "server/base/sha256.h"
#include "server/follow/follower.h"
#include "server/scene/scene.h"
#include "server/show/followed_show.h"
#include "tests/unit/server/undo_fixture.h"

namespace gonio::undo_test {

// The leader is UndoTest's.
class Follow : public UndoTest {
protected:
    void SetUp() override {
        UndoTest::SetUp();
        stage->set_boot("leader", 0);
    }
    // Asks as a follower that has this. Result: the answer; nothing where it has to wait.
    std::optional<v1::Followed> ask(const std::string& boot, Revision since, std::uint32_t session = 7) {
        Work work{.session = session};
        work.message.set_request_id(1);
        work.message.mutable_follow()->set_boot(boot);
        work.message.mutable_follow()->set_since_rev(since);
        reply.Clear();
        stage->take(std::move(work));
        if (!reply.has_followed()) return std::nullopt;
        return reply.followed();
    }
    std::shared_ptr<const Profile> profile_of(const std::string& key) {
        const auto known = profiles.find(key);
        if (known != profiles.end()) return known->second;
        show_of(scene(), leader_texts);
        const auto content = leader_texts.known().at(key);
        EXPECT_EQ(sha256(*content), key);
        auto read = followed_profile(*content, true);
        EXPECT_TRUE(read) << read.error().text();
        return profiles[key] = *read;
    }
    // Takes what was told. Result: the warnings.
    std::vector<std::string> take(const v1::Followed& followed, bool anew = false) {
        const auto show = read_followed(followed);
        EXPECT_TRUE(show) << show.error().text();
        FetchedParts fetched{asset, nullptr, nullptr, {}};
        for (const saved::Profile& profile : show->show.profiles())
            fetched.profiles[profile.key()] = profile_of(profile.key());
        RestoredShow restored = follow_show(follower, *show, fetched, anew);
        follower = std::move(restored.scene);
        return restored.warnings;
    }
    // The follower asks for what is new, and takes it.
    void catch_up() {
        const auto told = ask(known_boot, follower.scene_rev);
        if (!told) return;
        const auto warnings = take(*told);
        EXPECT_TRUE(warnings.empty()) << warnings.front();
        known_boot = told->boot();
    }
    std::string hash(const Scene& of) {
        ProfileTexts fresh;
        return show_hash(of, fresh);
    }
    void expect_equal(const std::string& when) {
        ASSERT_EQ(follower.scene_rev, scene().scene_rev) << when;
        if (hash(follower) == hash(scene())) return;
        ProfileTexts one, other;
        saved::Show is = show_of(follower, one), was = show_of(scene(), other);
        for (saved::Show* show : {&is, &was}) show->clear_profiles();
        FAIL() << when << ": " << difference(write_show(is), write_show(was));
    }

    Scene follower = unheard_scene("http://leader");
    std::string known_boot;
    ProfileTexts leader_texts;
    std::map<std::string, std::shared_ptr<const Profile>> profiles;
};

}  // namespace gonio::undo_test
