#include "server/session/followers.h"

#include <algorithm>
#include <filesystem>

#include "protocol/schema/codec.h"
#include "server/assets/assets.h"
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

void Followers::take(const Work& work, const Scene& scene, const std::string& boot, Replies& replies) {
    if (work.message.request_id() == 0) return;
    const v1::Follow& follow = work.message.follow();
    if (const auto before = waiting_.find(work.session); before != waiting_.end()) {
        replies.refuse(before->second.work, {"unexpected", "follow", "", "another Follow of this client came"});
        waiting_.erase(before);
    }
    if (follow.boot() == boot && follow.since_rev() == scene.scene_rev)
        waiting_[work.session] = {work, show_file(scene)};
    else
        answer(work, scene, boot, replies);
}

void Followers::tell(const Scene& scene, const std::string& boot, Replies& replies) {
    for (auto at = waiting_.begin(); at != waiting_.end();) {
        const v1::Follow& follow = at->second.work.message.follow();
        const bool news =
            follow.boot() != boot || follow.since_rev() != scene.scene_rev || !same(at->second.told, show_file(scene));
        if (news) answer(at->second.work, scene, boot, replies);
        at = news ? waiting_.erase(at) : std::next(at);
    }
}

void Followers::refuse(const Error& error, Replies& replies) {
    for (const auto& [session, waiting] : waiting_) replies.refuse(waiting.work, error);
    waiting_.clear();
}

void Followers::answer(const Work& work, const Scene& scene, const std::string& boot, Replies& replies) {
    const v1::Follow& follow = work.message.follow();
    const bool knows = follow.boot() == boot && follow.since_rev() <= scene.scene_rev;
    const bool file = scene.asset->files || is_built_in(scene.asset->name);
    if (!file) {
        replies.refuse(work, {"unsupported", "follow", scene.asset->name,
                              "the files of this scene could not be read again, or are too many to be followed"});
        return;
    }
    v1::Followed followed = followed_of(scene, boot, knows ? follow.since_rev() : 0, texts_);
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
    replies.answer(work, message_of(&v1::ServerMessage::mutable_followed, std::move(followed)));
}

}  // namespace gonio
