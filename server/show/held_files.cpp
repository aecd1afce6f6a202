#include "server/show/held_files.h"

#include <stdlib.h>
#include <unistd.h>

#include <cerrno>
#include <filesystem>
#include <fstream>
#include <set>
#include <system_error>
#include <utility>

#include "protocol/text/shortened_text.h"
#include "server/assets/assets.h"
#include "server/base/bounded_file.h"
#include "server/base/own_folder.h"
#include "server/base/sha256.h"
#include "server/show/safe_path.h"

namespace gonio {
namespace {

namespace fs = std::filesystem;

constexpr const char* kFolder = ".part-XXXXXX";     // as the folder of uploads calls what it removes at its start
constexpr const char* kOwnFolder = ".part-goniod";  // among temporary files; make_own_folder() appends six letters

Error unwritable(const std::string& path, const std::string& why) {
    return {"file_unwritable", "scene", path, "The file of the scene cannot be written: " + why};
}

Error bad_file(const saved::HeldFile& file, const char* why) {
    return {"bad_state", "files", shortened_text(file.path(), 80), why};
}

std::string in_mib(std::uint64_t bytes) {
    return std::to_string((bytes + (std::uint64_t{1} << 20) - 1) >> 20) + " MiB";
}

// Errors: of make().
Result<bool> write_held(const saved::HeldFile& file, const fs::path& folder) {
    const fs::path path = folder / file.path();
    std::error_code failed;
    fs::create_directories(path.parent_path(), failed);
    if (failed) return unwritable(path.string(), failed.message());
    std::ofstream out(path, std::ios::binary);
    out.write(file.content().data(), static_cast<std::streamsize>(file.content().size()));
    out.close();
    if (!out) return unwritable(path.string(), std::generic_category().message(errno));
    return true;
}

}  // namespace

std::string why_not_held(const SceneAsset& asset) {
    if (is_built_in(asset.name)) return {};
    if (!asset.files) return "the scene's files could not be read again, or are more than 4,096";
    std::uint64_t bytes = 0;
    for (const AssetFile& file : asset.files->files) bytes += file.bytes;
    if (bytes <= kMostHeldBytes) return {};
    return "the scene's files have " + in_mib(bytes) + ", and a show holds " + in_mib(kMostHeldBytes) + " at most";
}

std::string hold_files(const SceneAsset& asset, bool content, saved::Show& show) {
    show.clear_files();
    if (const std::string why = why_not_held(asset); !why.empty() || !asset.files) return why;
    for (const AssetFile& file : asset.files->files) {
        saved::HeldFile& held = *show.add_files();
        held.set_path(file.path);
        held.set_sha256(file.sha256);
        if (!content) continue;
        auto bytes = read_bounded_file((fs::path(asset.files->folder) / file.path).string(), file.bytes);
        if (bytes && sha256(*bytes) == file.sha256) {
            held.set_content(std::move(*bytes));
            continue;
        }
        show.clear_files();
        return "the scene's file '" + shortened_text(file.path, 80) +
               (bytes ? "' was changed since it was loaded" : "' " + bytes.error().message);
    }
    return {};
}

std::string held_key(const saved::Show& show) {
    if (show.files().empty()) return {};
    std::string all;
    for (const saved::HeldFile& file : show.files()) all += file.path() + '\0' + file.sha256() + '\n';
    return sha256(all);
}

Result<std::shared_ptr<const HeldFolder>> HeldFolder::make(const std::string& parent) {
    if (parent.empty()) {
        std::error_code failed;
        const fs::path temporary = fs::temp_directory_path(failed);
        if (failed) return unwritable(temporary.string(), failed.message());
        auto own = make_own_folder(temporary.string(), kOwnFolder);
        if (!own) return unwritable(own.error().where, own.error().message);
        return std::shared_ptr<const HeldFolder>(new HeldFolder(std::move(own->path), std::move(own->held)));
    }
    std::string path = fs::path(parent) / kFolder;
    if (::mkdtemp(path.data()) == nullptr) return unwritable(path, std::generic_category().message(errno));
    return std::shared_ptr<const HeldFolder>(new HeldFolder(std::move(path), Descriptor()));
}

HeldFolder::~HeldFolder() {
    std::error_code failed;  // it may have gone with the folder that it is in
    fs::remove_all(path_, failed);
}

Result<std::shared_ptr<const HeldFolder>> unpack_files(const saved::Show& show, const std::string& parent) {
    if (show.files_size() > static_cast<int>(kMostAssetFiles))
        return Error{"too_large", "files", std::to_string(show.files_size()), "a show has at most 4,096 files"};
    std::set<std::string> paths;
    std::uint64_t bytes = 0;
    for (const saved::HeldFile& file : show.files()) {
        if (!is_safe_path(file.path()) || !paths.insert(file.path()).second)
            return bad_file(file, "must be a relative path of plain names, each once");
        if (sha256(file.content()) != file.sha256()) return bad_file(file, "has another content than its hash says");
        bytes += file.content().size();
    }
    if (bytes > kMostHeldBytes)
        return Error{"too_large", "files", in_mib(bytes), "a show holds " + in_mib(kMostHeldBytes) + " of a scene"};
    auto folder = HeldFolder::make(parent);
    if (!folder) return folder.error();
    for (const saved::HeldFile& file : show.files())
        if (const auto written = write_held(file, (*folder)->path()); !written) return written.error();
    return folder;
}

Result<std::shared_ptr<const HeldFolder>> link_files(const std::string& folder, const std::string& own) {
    auto held = HeldFolder::make(folder);
    if (!held) return held.error();
    std::error_code failed;
    std::size_t files = 0;
    for (fs::directory_iterator entry(folder, failed), end; !failed && entry != end; entry.increment(failed)) {
        std::error_code gone;  // meanwhile
        const std::string name = entry->path().filename().string();
        if (!own.ends_with(".gltf") && name != own) continue;  // others bring all in one file
        if (name.starts_with('.') || entry->symlink_status(gone).type() != fs::file_type::regular) continue;
        if (++files > kMostAssetFiles) break;
        const std::string second = (fs::path((*held)->path()) / name).string();
        if (::link(entry->path().c_str(), second.c_str()) != 0 && errno != ENOENT)
            return unwritable(second, std::generic_category().message(errno));
    }
    if (failed) return unwritable(folder, failed.message());
    return held;
}

std::shared_ptr<const SceneAsset> with_folder(std::shared_ptr<const SceneAsset> asset,
                                              std::shared_ptr<const HeldFolder> folder) {
    const SceneAsset* const shown = asset.get();
    const auto both = std::make_shared<std::pair<std::shared_ptr<const HeldFolder>, std::shared_ptr<const SceneAsset>>>(
        std::move(folder), std::move(asset));
    return {both, shown};
}

}  // namespace gonio
