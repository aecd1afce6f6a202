// A sequence's scene, frame by frame: what its tracks, its events and its cues make of it. Frames come in order, so
// that the scene at a frame depends on the job alone. No GL; reads the files of profiles that commands name.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "protocol/schema/command.pb.h"
#include "server/scene/apply.h"
#include "server/scene/cue_player.h"
#include "server/scene/scene.h"
#include "server/sequence/sequence.h"
#include "server/session/scene_access.h"

namespace gonio::sequence {

// Carries out a command of a job at once: exposures that are automatic are metered, presets come without a fade. Throws
// job::Refused with this place.
void apply_words(Scene& scene, const std::vector<std::string>& words, const SceneAccess& access,
                 const std::string& place);

class Timeline {
public:
    // Carries out sequence.set; the scene is that before the first frame. Both must outlive it. Throws job::Refused.
    Timeline(Scene scene, const Sequence& sequence, const SceneAccess& access);

    // Goes to the next frame; the first call to frame 0. Throws job::Refused, with the frame in its place.
    void next();
    int frame() const { return frame_; }  // -1 before the first
    const Scene& scene() const { return scene_; }
    // SHA-256 of all that the job's commands brought from outside so far: the texts of profiles, in order.
    const std::string& files() const { return files_; }

private:
    // Tracks that one command sets together: of one light its level and its aim.
    struct Group {
        std::vector<const Track*> tracks;
        std::vector<std::string> said;  // the command's words at the frame before
        v1::Command command;
        Loaded loaded;
    };
    void count(const v1::Command& command);
    void run(const Event& event);
    void set(Group& group, double t_s);

    Scene scene_;
    const Sequence& sequence_;
    const SceneAccess& access_;
    CuePlayer player_;
    std::vector<Event> events_;
    std::vector<Group> groups_;
    std::string files_;
    std::size_t next_event_ = 0;
    int frame_ = -1;
};

}  // namespace gonio::sequence
