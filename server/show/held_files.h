// The files of a scene inside its show: what the show needs where they are not, after a restart or on another machine.
// Any thread; all that reads or writes them takes as long as the disk.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "ies/core/result.h"
#include "protocol/schema/saved.pb.h"
#include "server/base/descriptor.h"
#include "server/scene/asset.h"

namespace gonio {

// Of all files of a scene that a show holds. As text they take a third more, and a show has 256 MiB at most.
inline constexpr std::uint64_t kMostHeldBytes = std::uint64_t{128} << 20;

inline constexpr std::uint64_t kMaxHeldNames = std::uint64_t{8} << 20;  // bytes of their paths and hashes

// Result: why a show of the scene does not hold its files, a sentence; empty: it does, or they are built in. Looks at
// no disk.
std::string why_not_held(const SceneAsset& asset);
// Puts the files into the show; without content their names and hashes alone. Result: why not, a sentence; then the
// show has none of them. A file that was changed since the scene was read is no file of this scene.
std::string hold_files(const SceneAsset& asset, bool content, saved::Show& show);
// Result: names the files of a show by their content; empty: it has none.
std::string held_key(const saved::Show& show);

// A folder of its own that goes with its last user. Where goniod is killed, the next one to start removes it: by the
// folder of uploads that it is in, or as own_folder.h says.
class HeldFolder {
public:
    // In `parent`; empty: in the folder for temporary files. Errors: "file_unwritable".
    static Result<std::shared_ptr<const HeldFolder>> make(const std::string& parent);
    ~HeldFolder();
    HeldFolder(const HeldFolder&) = delete;
    HeldFolder& operator=(const HeldFolder&) = delete;
    const std::string& path() const { return path_; }

private:
    HeldFolder(std::string path, Descriptor held) : path_(std::move(path)), held_(std::move(held)) {}
    std::string path_;
    Descriptor held_;  // of a folder for temporary files
};

// Writes the files of a show into such a folder. Errors: "bad_state" for a path that leaves the folder or a content
// that is not what its hash says; "too_large"; "file_unwritable".
Result<std::shared_ptr<const HeldFolder>> unpack_files(const saved::Show& show, const std::string& parent);
// A second name for a file of a folder, in such a folder within it: it stays as it is when another takes its name. So
// do the files beside a .gltf, which may need them. own: its name. Errors: "file_unwritable", also where the disk knows
// no second names.
Result<std::shared_ptr<const HeldFolder>> link_files(const std::string& folder, const std::string& own);
// Result: the scene, which keeps the folder.
std::shared_ptr<const SceneAsset> with_folder(std::shared_ptr<const SceneAsset> asset,
                                              std::shared_ptr<const HeldFolder> folder);

}  // namespace gonio
