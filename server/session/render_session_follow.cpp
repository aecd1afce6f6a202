// A RenderSession among others: what it hears of a leader, and what servers that follow it ask.
#include <spdlog/spdlog.h>

#include "protocol/schema/cue.pb.h"
#include "protocol/schema/state.pb.h"
#include "server/scene/scene.h"
#include "server/scene/state.h"
#include "server/session/render_session.h"

namespace gonio {

void RenderSession::set_leader(std::string address) {
    leader_cues_ = cue_playback();
    roles_.set_leader(address);
    leader_ = std::move(address);
    in_touch_ = false;
}

static Error out_of_touch(const std::string& leader) {
    return {"unavailable", "follow", leader,
            "this server follows that one and is out of touch with it; where servers follow each other in a ring, none "
            "of them has a show"};
}

void RenderSession::take_follow(const Work& work) {
    if (!in_touch_) return replies_.refuse(work, out_of_touch(leader_));
    followers_.take(work, shown(), replies_);
}

Followers::Shown RenderSession::shown() const {
    return {scene_, boot_, cues_told_, [this] { return cue_playback(); }};
}

v1::CuePlayback RenderSession::cue_playback() const {
    return follows() ? leader_cues_ : cues_.playback(scene_, monotonic_ns());
}

void RenderSession::take_leader(const std::shared_ptr<const LeaderNews>& news) {
    if (!news->scene) {
        in_touch_ = false;
        return followers_.refuse(out_of_touch(leader_), replies_);
    }
    if (anew_ || news->anew)  // one that came meanwhile has all of the one before
        anew_ = news;
    else
        take_scene(*news);
}

void RenderSession::begin_anew() {
    const auto news = std::exchange(anew_, nullptr);
    changes_ = Changes(news->scene->scene_rev);
    reports_.forget();
    hidden_ = {};  // ids of lights may be others
    take_scene(*news);
}

void RenderSession::take_scene(const LeaderNews& news) {
    const Scene before = std::exchange(scene_, *news.scene);
    in_touch_ = true;
    if (scene_.asset != before.asset) list_profiles();
    v1::StateChanged change = state_change(before, scene_);
    if (std::exchange(boot_, news.boot) != boot_) change.mutable_state()->set_boot(boot_);
    if (news.cues.SerializeAsString() != leader_cues_.SerializeAsString())
        *change.mutable_state()->mutable_cue_playback() = leader_cues_ = news.cues;
    tell(std::move(change), 0);
}

}  // namespace gonio
