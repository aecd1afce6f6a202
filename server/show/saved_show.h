// Scene <-> what is kept of it on disk (protocol/schema/saved.proto). Pure; any thread.
#pragma once

#include <bitset>
#include <chrono>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "ies/core/result.h"
#include "protocol/schema/saved.pb.h"
#include "server/scene/scene.h"

namespace gonio {

inline constexpr std::uint32_t kSavedVersion = 1;
// A service must be ready in 30 s, whatever its show holds.
inline constexpr std::chrono::milliseconds kProfileTime{12'000};
inline constexpr std::size_t kMaxSavedBytes = std::size_t{256} << 20;  // a larger file is not read: "too_large"
// Revisions that clients may have seen though no file holds them, because the program was killed or the disk was full.
inline constexpr Revision kUnsavedRevisions = 1'000'000;
// From here on revisions begin at 1 again, so that none is ever close to the last that fits.
inline constexpr Revision kMaxSavedRevision = Revision{1} << 31;

// Profiles as text, kept from one show to the next: writing a web takes longer than all else.
class ProfileTexts {
public:
    struct Text {
        std::string key;                             // SHA-256 of the content
        std::shared_ptr<const std::string> content;  // name, 0, photometry as LM-63-2019; then 0, saved.Profile
    };
    const Text& of(const std::shared_ptr<const Profile>& profile);
    // Result: SHA-256 of what the profile is. Without a wheel it is the key of its text; with one it is made without
    // decoding the wheel's pictures.
    const std::string& hash_of(const std::shared_ptr<const Profile>& profile);
    // The profile as a show holds it.
    void put(const std::shared_ptr<const Profile>& profile, saved::Profile& saved);
    // Result: the contents that are known, by key; none of those of which only the hash was asked for.
    std::map<std::string, std::shared_ptr<const std::string>> known() const;
    // Forgets those that nobody asked for since the last call.
    void forget_unused();
    // Forgets those of profiles that nobody else has any more.
    void forget_gone();

private:
    struct Entry {
        Text text;
        std::string hash;  // of hash_of()
        bool used = true;
    };
    std::map<std::shared_ptr<const Profile>, Entry> texts_;
};

// What of a show is told apart when it changes.
enum class ShowPart : std::uint8_t {
    scene,
    lights,
    values,  // of lights, where the list of them is as it was
    groups,
    presets,  // and cues, which share their lights
    cue_play,
    camera,
    saved_views,
    grids,
    observers,
    exposure,
    view,
    look,
    haze,
    master,
    technique,
    size,
    patch,
    surfaces,
    file  // the name that the show was saved under
};
inline constexpr std::size_t kShowParts = static_cast<std::size_t>(ShowPart::file) + 1;
struct ShowParts : std::bitset<kShowParts> {
    bool has(ShowPart part) const { return test(static_cast<std::size_t>(part)); }
    void put(ShowPart part) { set(static_cast<std::size_t>(part)); }
};

// Result: everything of the scene that makes the show.
saved::Show show_of(const Scene& scene, ProfileTexts& texts);
// Result: these parts of it. Of ShowPart::values those lights that changed after the revision values_since. With
// by_content no light takes its profile from the scene's file, but each by the key of what it is.
saved::Show show_of(const Scene& scene, ProfileTexts& texts, const ShowParts& parts, Revision values_since,
                    bool by_content = false);

// Errors: "bad_state" (no JSON of this message), "unsupported" (of a later version), "too_large".
Result<saved::Show> read_show(std::string_view json);
std::string write_show(const saved::Show& show);

// Result: the revision with which a server goes on that has read the show: greater than any that a client has seen,
// and 1 after kMaxSavedRevision.
Revision revision_after(const saved::Show& show);
// Whether a scene's name means the saved scene.
bool is_scene_of(const saved::Show& show, const std::string& scene);

struct RestoredShow {
    Scene scene;
    std::vector<std::string> warnings;  // of each thing that could not be brought back, one sentence
};
// The asset with all that the show says of it. It is brought back by commands, so that all their checks hold. With
// same_scene, the asset is the show's own scene. Else lights, groups and camera are left as the asset has them. After
// profile_time no profile is read any more, and lights that want one are left out. gels: Scene::gels; lights whose gel
// nobody knows have none.
RestoredShow restore_show(const saved::Show& show, std::shared_ptr<const SceneAsset> asset, bool same_scene,
                          std::chrono::milliseconds profile_time = kProfileTime,
                          std::shared_ptr<const Gels> gels = nullptr);

}  // namespace gonio
