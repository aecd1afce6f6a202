#include "server/show/show_folder.h"

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <vector>

#include "protocol/schema/show.pb.h"
#include "protocol/text/shortened_text.h"
#include "server/base/atomic_file.h"
#include "server/base/bounded_file.h"
#include "server/show/saved_show.h"

namespace gonio {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kEnding = ".json";

std::string path_of(const std::string& folder, const std::string& name) {
    return (fs::path(folder) / (name + std::string(kEnding))).string();
}

// What the folder itself holds: a link might lead out of it.
bool is_own_file(const fs::path& path) {
    std::error_code failed;
    return fs::symlink_status(path, failed).type() == fs::file_type::regular;
}

bool is_there(const fs::path& path) {
    std::error_code failed;
    return fs::exists(fs::symlink_status(path, failed));
}

}  // namespace

Result<std::string> checked_show_name(std::string_view given, const std::string& field) {
    std::string name(given);
    if (name.ends_with(kEnding)) name.resize(name.size() - kEnding.size());
    const bool path = name.find_first_of("/\\:") != name.npos || name.starts_with('.');
    if (name.empty() || name.size() > kMaxShowName || path || shortened_text(name, kMaxShowName) != name)
        return Error{
            "invalid_argument", field, shortened_text(given, kMaxShowName),
            "the name of a show has 1 to 100 bytes of UTF-8 without control characters, \"/\", \"\\\", \":\" or a "
            "dot in front"};
    return name;
}

Result<v1::Shows> list_shows(const std::string& folder) {
    v1::Shows shows;
    std::error_code failed;
    if (folder.empty() || !fs::exists(folder, failed)) return shows;
    const auto now = fs::file_time_type::clock::now();
    std::vector<v1::ShowEntry> found;
    for (fs::directory_iterator entry(folder, failed), end; !failed && entry != end; entry.increment(failed)) {
        const std::string file = entry->path().filename().string();
        if (!file.ends_with(kEnding) || !is_own_file(entry->path()) || !checked_show_name(file, "")) continue;
        std::error_code gone;  // meanwhile
        v1::ShowEntry& show = found.emplace_back();
        show.set_name(file.substr(0, file.size() - kEnding.size()));
        show.set_bytes(static_cast<double>(entry->file_size(gone)));
        show.set_age_s(std::max(0.0, std::chrono::duration<double>(now - entry->last_write_time(gone)).count()));
        if (gone) found.pop_back();
    }
    if (failed) return Error{"file_unreadable", "shows", folder, "The folder cannot be read: " + failed.message()};
    std::ranges::sort(found, {}, [](const v1::ShowEntry& show) { return show.name(); });
    shows.set_left_out(static_cast<std::uint32_t>(found.size() - std::min(found.size(), kMostShows)));
    found.resize(std::min(found.size(), kMostShows));
    for (v1::ShowEntry& show : found) *shows.add_shows() = std::move(show);
    return shows;
}

Result<bool> write_show_file(const std::string& folder, const std::string& name, const std::string& json,
                             bool replace) {
    const std::string path = path_of(folder, name);
    if (json.empty()) return Error{"file_unwritable", "save_show.name", path, "a name in the show is not UTF-8"};
    if (json.size() > kMaxSavedBytes)
        return Error{"too_large", "save_show.name", path, "a saved show has at most 256 MiB"};
    if (is_there(path) && !is_own_file(path))
        return Error{"file_unwritable", "save_show.name", path, "something is there that is no regular file"};
    if (is_there(path) && !replace)
        return Error{"already_exists", "save_show.name", name, "there is another show of this name"};
    std::error_code failed;
    fs::create_directories(folder, failed);
    if (failed)
        return Error{"file_unwritable", "save_show.name", folder, "The folder cannot be made: " + failed.message()};
    return write_file_atomically(path, json);
}

static Error no_such_show(const std::string& field, const std::string& name) {
    return {"not_found", field, name, "there is no show of this name in the server's folder"};
}

Result<bool> rename_show_file(const std::string& folder, const std::string& name, const std::string& new_name) {
    const std::string from = path_of(folder, name), to = path_of(folder, new_name);
    if (folder.empty() || !is_own_file(from)) return no_such_show("rename_show.name", name);
    if (from == to) return true;
    if (is_there(to))
        return Error{"already_exists", "rename_show.new_name", new_name, "there is another show of this name"};
    std::error_code failed;
    fs::rename(from, to, failed);
    if (!failed) return true;
    return Error{"file_unwritable", "rename_show.name", from, "The file cannot be renamed: " + failed.message()};
}

Result<bool> remove_show_file(const std::string& folder, const std::string& name) {
    const std::string path = path_of(folder, name);
    if (folder.empty() || !is_own_file(path)) return no_such_show("remove_show.name", name);
    std::error_code failed;
    if (fs::remove(path, failed) && !failed) return true;
    return Error{"file_unwritable", "remove_show.name", path, "The file cannot be removed: " + failed.message()};
}

Result<std::string> read_show_file(const std::string& folder, const std::string& name, std::size_t most_bytes) {
    const std::string path = path_of(folder, name);
    if (folder.empty() || !is_own_file(path)) return no_such_show("show", name);
    auto text = read_bounded_file(path, most_bytes);
    if (text && text->size() > most_bytes)
        return Error{"too_large", "show", name, "it has more than " + std::to_string(most_bytes) + " bytes"};
    return text;
}

}  // namespace gonio
