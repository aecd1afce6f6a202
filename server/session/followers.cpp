#include "server/session/followers.h"

#include <algorithm>
#include <filesystem>
#include <utility>

#include "protocol/schema/codec.h"
#include "protocol/schema/gonio.pb.h"
#include "protocol/schema/show.pb.h"
#include "protocol/schema/state.pb.h"
#include "server/assets/assets.h"
#include "server/scene/scene.h"
#include "server/scene/state.h"

namespace gonio {
namespace {

bool same(const v1::ShowFile& a, const v1::ShowFile& b) {
    return a.name() == b.name() && a.unsaved() == b.unsaved();
}

bool same_keys(const Blobs& a, const Blobs& b) {
    return std::ranges::equal(
        a, b, {}, [](const auto& row) { return row.first; }, [](const auto& row) { return row.first; });
}

Blobs blobs_of(const AssetFiles* files, const ProfileTexts& texts) {
    Blobs blobs;
    for (auto& [key, content] : texts.known()) blobs[key] = {content, "", content->size()};
    if (files == nullptr) return blobs;
    for (const AssetFile& file : files->files)
        blobs[file.sha256] = {nullptr, (std::filesystem::path(files->folder) / file.path).string(), file.bytes};
    return blobs;
}

}  // namespace

bool Followers::knows_all(const One& one, const v1::Follow& follow, const Shown& shown) {
    return follow.boot() == shown.boot && follow.since_rev() == shown.scene.scene_rev && one.told &&
           one.cues == shown.cues && same(one.file, show_file(shown.scene));
}

void Followers::take(const Work& work, const Shown& shown, Replies& replies) {
    if (work.message.request_id() == 0) return;
    One& one = followers_[work.session];
    if (one.waiting) {
        replies.refuse(*one.waiting, {"unexpected", "follow", "", "another Follow of this client came"});
        one.waiting.reset();
    }
    if (knows_all(one, work.message.follow(), shown))
        one.waiting = work;
    else
        answer(one, work, shown, replies);
}

void Followers::tell(const Shown& shown, Replies& replies) {
    for (auto& [session, one] : followers_) {
        if (!one.waiting || knows_all(one, one.waiting->message.follow(), shown)) continue;
        const Work work = *std::exchange(one.waiting, std::nullopt);
        answer(one, work, shown, replies);
    }
}

void Followers::refuse(const Error& error, Replies& replies) {
    for (auto& [session, one] : followers_)
        if (const auto waiting = std::exchange(one.waiting, std::nullopt)) replies.refuse(*waiting, error);
}

void Followers::answer(One& one, const Work& work, const Shown& shown, Replies& replies) {
    const Scene& scene = shown.scene;
    const v1::Follow& follow = work.message.follow();
    const bool knows = follow.boot() == shown.boot && follow.since_rev() <= scene.scene_rev;
    const bool file = scene.asset->files || is_built_in(scene.asset->name);
    if (!file) {
        replies.refuse(work, {"unsupported", "follow", scene.asset->name,
                              "the files of this scene could not be read again, or are too many to be followed"});
        return;
    }
    v1::Followed followed = followed_of(scene, shown.boot, knows ? follow.since_rev() : 0, texts_);
    *followed.mutable_cue_playback() = shown.cue_playback();
    if (followed.ByteSizeLong() > kMaxServerMessageBytes - 1024) {
        replies.refuse(work, {"too_large", "follow", std::to_string(followed.ByteSizeLong()) + " bytes",
                              "a show of more than 256 MiB cannot be followed"});
        return;
    }
    texts_.forget_gone();
    Blobs blobs = blobs_of(scene.asset->files.get(), texts_);
    if (!published_ || published_files_ != scene.asset->files || !same_keys(*published_, blobs)) {
        published_ = std::make_shared<const Blobs>(std::move(blobs));
        published_files_ = scene.asset->files;
        publish_(published_);
    }
    one.file = show_file(scene);
    one.cues = shown.cues;
    one.told = true;
    replies.answer(work, message_of(&v1::ServerMessage::mutable_followed, std::move(followed)));
}

}  // namespace gonio
