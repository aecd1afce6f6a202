// The servers that follow this one, each with at most one question that waits. Follow is answered when there is
// something that the asker does not have, with all of it at once. Nothing is kept for one that is slow or gone. Render
// thread.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "server/http/blobs.h"
#include "server/session/replies.h"
#include "server/show/followed_show.h"

namespace gonio {

class Followers {
public:
    using PublishBlobs = std::function<void(std::shared_ptr<const Blobs>)>;
    explicit Followers(PublishBlobs publish) : publish_(std::move(publish)) {}

    // What is told. cues: how often clients have been told of cue_playback().
    struct Shown {
        const Scene& scene;
        const std::string& boot;
        std::uint64_t cues = 0;
        std::function<v1::CuePlayback()> cue_playback;
    };
    // work: of a Follow. Takes the place of one of the same session that waits, which is answered "unexpected".
    void take(const Work& work, const Shown& shown, Replies& replies);
    // Something of it has changed, or what is known of the show's file.
    void tell(const Shown& shown, Replies& replies);
    // All that wait are answered so.
    void refuse(const Error& error, Replies& replies);
    void forget_session(std::uint32_t session) { followers_.erase(session); }

private:
    struct One {
        std::optional<Work> waiting;
        v1::ShowFile file;       // that it was told last
        std::uint64_t cues = 0;  // likewise, of Shown
        bool told = false;
    };
    static bool knows_all(const One& one, const v1::Follow& follow, const Shown& shown);
    void answer(One& one, const Work& work, const Shown& shown, Replies& replies);

    PublishBlobs publish_;
    std::map<std::uint32_t, One> followers_;  // by session
    ProfileTexts texts_;
    std::shared_ptr<const Blobs> published_;
    std::shared_ptr<const AssetFiles> published_files_;
};

}  // namespace gonio
