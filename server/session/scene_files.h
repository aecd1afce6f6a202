// The scene as a file for a client: written by a worker of its own, one after the other, so that neither frames nor the
// loader wait. A job holds the scene as it was when it was asked for. Render thread.
#pragma once

#include <atomic>
#include <memory>

#include "server/session/loader.h"
#include "server/session/replies.h"

namespace gonio {

inline constexpr unsigned kMaxSceneFiles = 4;  // that wait or are being written; beyond it: "busy"

// Result: whether a capture's format is that of a scene: "glb" or "mvr".
bool is_scene_format(const std::string& format);
// Errors: "unsupported" where the query asks for more than format and after_rev.
std::optional<Error> check_scene_file(const v1::CaptureQuery& query);

class SceneFiles {
public:
    explicit SceneFiles(Replies::Send send) : send_(std::move(send)) {}

    // work: of a capture that check_scene_file() passed. Its answer is a CaptureResult with the file as image and what
    // it leaves out as warnings, or the refusal of export_glb(). Meanwhile its client is told of the progress, twice a
    // second.
    void add(const Work& work, const Scene& scene, Replies& replies);

private:
    Replies::Send send_;
    std::shared_ptr<std::atomic<unsigned>> unfinished_ = std::make_shared<std::atomic<unsigned>>(0);
    Loader writer_;
};

}  // namespace gonio
