// The servers that follow this one, each with at most one question that waits: Follow is answered when there is
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

    // work: of a Follow. Takes the place of one of the same session that waits, which is answered "unexpected".
    void take(const Work& work, const Scene& scene, const std::string& boot, Replies& replies);
    // The scene has changed, or what is known of its file.
    void tell(const Scene& scene, const std::string& boot, Replies& replies);
    // All that wait are answered so.
    void refuse(const Error& error, Replies& replies);
    void forget_session(std::uint32_t session) { waiting_.erase(session); }

private:
    struct Waiting {
        Work work;
        v1::ShowFile told;  // of the show's file, when it was asked
    };
    void answer(const Work& work, const Scene& scene, const std::string& boot, Replies& replies);

    PublishBlobs publish_;
    std::map<std::uint32_t, Waiting> waiting_;  // by session
    ProfileTexts texts_;
    std::shared_ptr<const Blobs> published_;
    std::shared_ptr<const AssetFiles> published_files_;
};

}  // namespace gonio
