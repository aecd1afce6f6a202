// What the reader of JOB.json promises, whatever the bytes: a job is refused with its place, or all of its frames are
// what the scene takes. Shared by the fuzz target and its replay test.
#pragma once

#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <string_view>

#include "server/assets/assets.h"
#include "server/scene/scene.h"
#include "server/sequence/sequence_job.h"
#include "server/sequence/timeline.h"
#include "tests/fuzz/require.h"

namespace gonio::fuzz {

// Result: whether the job is taken.
inline bool check_job(std::string_view text) {
    bool taken = false;
    constexpr int kFrames = 16;  // of the job's first, which are gone through
    static const Scene scene = scene_of(*load_scene("cornell", "", {}, std::size_t{1} << 32));
    const int file = memfd_create("job", MFD_CLOEXEC);
    require(file >= 0 && write(file, text.data(), text.size()) == static_cast<ssize_t>(text.size()));
    try {
        const job::Json job = job::read_job("/proc/self/fd/" + std::to_string(file));
        const sequence::Sequence sequence = sequence::sequence_of(job.contains("sequence") ? job["sequence"] : job);
        require(sequence.frames >= 1 && sequence.frames <= sequence::kMostFrames);
        require(sequence.tracks.size() <= sequence::kMostTracks && sequence.events.size() <= sequence::kMostEvents);
        for (const int frame : {0, sequence.frames - 1}) {
            const std::string name = sequence::frame_name(sequence, frame);
            require(!name.empty() && name[0] != '/' && ("/" + name + "/").find("/../") == std::string::npos);
        }
        const SceneAccess none{.any_path = false};
        sequence::Timeline timeline(scene, sequence, none);
        for (int i = 0; i < std::min(sequence.frames, kFrames); ++i) timeline.next();
        for (const Light& light : timeline.scene().lights)
            require(light.level_ratio >= 0.0 && light.level_ratio <= 1.0);
        taken = true;
    } catch (const job::Refused& refused) {
        check_refusal(refused.error);
        require(!refused.place.empty());
    }
    close(file);
    return taken;
}

}  // namespace gonio::fuzz
