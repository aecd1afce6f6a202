// What a server tells one that follows it (v1::Followed), and what that makes of it. The show is told as state, not as
// commands: whoever missed something is told all that changed since what it has. Any thread.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "ies/core/result.h"
#include "server/scene/asset.h"
#include "server/scene/asset_files.h"
#include "server/scene/light.h"
#include "server/show/saved_show.h"

namespace gonio {
struct Scene;
}  // namespace gonio

namespace gonio::v1 {
class Followed;
}

namespace gonio {

// ---- of the leader

// Result: what changed after the revision; 0: the whole show. The name of its file is told each time. Profiles have no
// photometry: their content is fetched by its key.
v1::Followed followed_of(const Scene& scene, const std::string& boot, Revision since, ProfileTexts& texts);
// Result: SHA-256 of what makes the show, whatever its revision and wherever its files are.
std::string show_hash(const Scene& scene, ProfileTexts& texts);

// ---- of the follower

inline constexpr int kMaxFollowedProfiles = 100'000;  // of a message

struct FollowedShow {
    std::string boot;
    Revision rev = 0, since = 0;  // since 0: it is the whole show
    ShowParts parts;
    saved::Show show;
    std::vector<AssetFile>
        files;  // of the scene; none: it is a built-in one, or ShowPart::scene is not among the parts
};

// Errors: "bad_message" with the field as place: an unknown part, a show that is none, a path that leaves its folder, a
// hash that is none, more than the bounds.
Result<FollowedShow> read_followed(const v1::Followed& followed);

// content: of a profile, as ProfileTexts has it. Errors: of make_profile; "bad_message".
Result<std::shared_ptr<const Profile>> followed_profile(const std::string& content, bool uploaded);

// What was fetched for it.
struct FetchedParts {
    std::shared_ptr<const SceneAsset> asset;  // of ShowPart::scene
    std::shared_ptr<const trace::Geometry> traced;
    std::shared_ptr<const lighting::Drawn> drawn;
    std::map<std::string, std::shared_ptr<const Profile>> profiles;  // by key
};
// Result: the scene with the parts that are told, at their revision, and warnings of what could not be brought about.
// What did not differ keeps its revision, so that nothing is rendered anew for it. anew: the leader's revisions began
// again, and none of before counts. Then all must be told, and `before` gives its gels alone.
RestoredShow follow_show(const Scene& before, const FollowedShow& followed, const FetchedParts& fetched, bool anew);

}  // namespace gonio
