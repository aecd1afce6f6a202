#include "server/session/library.h"

#include <sys/resource.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <set>

#include "ies/synthetic.h"
#include "protocol/schema/library.pb.h"
#include "protocol/schema/upload_name.h"
#include "protocol/text/did_you_mean.h"
#include "protocol/text/shortened_text.h"
#include "server/assets/assets.h"
#include "server/base/bounded_file.h"
#include "server/exchange/import_luminaire.h"
#include "server/scene/limits.h"
#include "server/session/command_files.h"
#include "server/session/profile_summary.h"

namespace gonio {
namespace {

namespace fs = std::filesystem;

std::string lower(std::string text) {
    for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    return text;
}

std::size_t most_bytes(const fs::path& path) {
    const std::string ending = ending_of(path.filename().string());
    return ending == ".gldf" || ending == ".gdtf" || ending == ".zip" ? kMaxContainerBytes : kMaxProfileBytes;
}

std::string too_large(const fs::path& path) {
    return "a profile may have at most " + std::to_string(most_bytes(path) >> 20) + " MiB";
}

// Result: the file with every link followed, where it lies below the folder; else empty.
std::string real_below(const fs::path& root, const fs::path& path) {
    std::error_code failed;
    const fs::path real = fs::canonical(path, failed), folder = failed ? fs::path() : fs::canonical(root, failed);
    if (failed || std::mismatch(folder.begin(), folder.end(), real.begin(), real.end()).first != folder.end())
        return {};
    return real.string();
}

std::vector<std::string> words_of(const std::string& text) {
    std::vector<std::string> words;
    std::string word;
    for (const char c : text + " ") {
        if (c != ' ') {
            word.push_back(c);
        } else if (!word.empty()) {
            words.push_back(lower(std::move(word)));
            word.clear();
        }
    }
    return words;
}

bool within(const v1::LibraryQuery& query, const v1::LibraryRow& row) {
    const bool flux = query.has_min_flux_lm() || query.has_max_flux_lm(),
               beam = query.has_min_beam_rad() || query.has_max_beam_rad();
    if (!flux && !beam) return true;
    const v1::PhotometrySummary& summary = row.summary();
    if (!row.has_summary() || (beam && !summary.has_beam_rad())) return false;
    return (!query.has_min_flux_lm() || summary.flux_lm() >= query.min_flux_lm()) &&
           (!query.has_max_flux_lm() || summary.flux_lm() <= query.max_flux_lm()) &&
           (!query.has_min_beam_rad() || summary.beam_rad() >= query.min_beam_rad()) &&
           (!query.has_max_beam_rad() || summary.beam_rad() <= query.max_beam_rad());
}

// Result: the same of two rows whose luminaires have one file name, flux and curve.
std::string luminaire_key(const v1::LibraryRow& row) {
    const std::string& name = row.name();
    const std::size_t folders = name.find_last_of("/:");
    return name.substr(folders == std::string::npos ? 0 : folders + 1) + '\n' + print_number(row.summary().flux_lm()) +
           '\n' + row.curve();
}

std::optional<Error> refused(const v1::LibraryQuery& query) {
    if (query.count() > kMaxLibraryRows)
        return Error{"invalid_argument", "library.count", std::to_string(query.count()), "must be at most 500"};
    for (const auto& [value, field] : {std::pair(query.min_flux_lm(), "min_flux_lm"),
                                       {query.max_flux_lm(), "max_flux_lm"},
                                       {query.min_beam_rad(), "min_beam_rad"},
                                       {query.max_beam_rad(), "max_beam_rad"}})
        if (!(value >= 0.0))
            return Error{"invalid_argument", std::string("library.") + field, print_number(value),
                         "must be a number of at least 0"};
    return std::nullopt;
}

}  // namespace

Library::Row Library::row_of(std::string name, std::string source, std::shared_ptr<const Profile> profile) {
    Row made;
    made.row.set_name(std::move(name));
    made.row.set_source(std::move(source));
    *made.row.mutable_summary() = summary_of(*profile);
    made.row.set_curve(curve_of(*profile));
    made.words = lower(made.row.name() + " " + made.row.summary().description());
    made.profile = std::move(profile);
    return made;
}

Library::Library(std::vector<std::string> folders, std::string upload_folder)
    : folders_(std::move(folders)),
      upload_folder_(std::move(upload_folder)),
      asked_(!folders_.empty()),
      uploads_asked_(!upload_folder_.empty()) {
    for (const ies::SyntheticLuminaire& luminaire : ies::synthetic_luminaires()) {
        const auto profile = builtin_profile(std::string(luminaire.name));
        if (profile) built_in_.push_back(row_of((*profile)->name, "built-in", *profile));
    }
    if (asked_ || uploads_asked_) thread_ = std::thread([this] { work(); });
}

Library::~Library() {
    {
        const std::lock_guard lock(mutex_);
        ending_ = true;
    }
    wake_.notify_all();
    if (thread_.joinable()) thread_.join();
}

void Library::work() {
    setpriority(PRIO_PROCESS, 0, 10);  // Linux: of this thread alone
    for (;;) {
        bool all = false, uploads = false;
        {
            std::unique_lock lock(mutex_);
            wake_.wait(lock, [this] { return ending_ || asked_ || uploads_asked_; });
            if (ending_) return;
            all = std::exchange(asked_, false);
            uploads = std::exchange(uploads_asked_, false);
            reading_ = true;
            if (all) {
                files_.clear();
                warnings_.clear();
            }
        }
        if (uploads) read_uploads();  // first: they are few, and somebody has just brought one
        if (all) read_folders();
        const std::lock_guard lock(mutex_);
        reading_ = false;
    }
}

static fs::file_time_type changed(const std::string& folder) {
    std::error_code failed;
    const auto time = fs::last_write_time(folder, failed);
    return failed ? fs::file_time_type() : time;
}

void Library::read_uploads() {
    const fs::file_time_type time = changed(upload_folder_);
    std::vector<Row> rows;
    std::size_t bytes = 0;
    std::error_code failed;
    for (auto at = fs::directory_iterator(upload_folder_, failed);
         !failed && at != fs::directory_iterator() && !ending_; at.increment(failed)) {
        if (rows.size() == kMaxKeptProfiles || bytes > kMaxLibraryBytes) break;
        const std::string name = at->path().filename().string();
        if (is_photometry_name(name) && is_upload_name(name))
            rows.push_back(
                read_row(upload_folder_, at->path().string(), "uploaded", std::string(kUploadPrefix) + name, bytes));
    }
    std::ranges::sort(rows, {}, [](const Row& row) { return row.row.name(); });
    const std::lock_guard lock(mutex_);
    for (const Row& row : rows)
        std::erase_if(kept_, [&](const Row& kept) { return kept.row.name() == row.row.name(); });
    uploads_ = std::move(rows);
    uploads_changed_ = time;
}

void Library::warn(std::string text) {
    const std::lock_guard lock(mutex_);
    warnings_.push_back(std::move(text));
}

void Library::read_folders() {
    std::size_t files = 0, bytes = 0;
    for (const std::string& root : folders_)
        if (!read_folder(root, files, bytes)) return;
}

// Result: whether there is room for more. files, bytes: read so far, of all folders.
bool Library::read_folder(const std::string& root, std::size_t& files, std::size_t& bytes) {
    std::error_code failed;
    std::vector<std::string> paths;
    std::size_t entries = 0;
    const auto options = fs::directory_options::skip_permission_denied;  // folders that are links are not entered
    auto at = fs::recursive_directory_iterator(root, options, failed);
    if (failed) {
        warn("the folder '" + root + "' cannot be read: " + failed.message());
        return true;
    }
    for (; !failed && at != fs::recursive_directory_iterator() && !ending_; at.increment(failed)) {
        if (++entries > kMaxLibraryEntries) {
            warn("the folder '" + root + "' has more than 100,000 entries: the rest is left out");
            break;
        }
        if (at.depth() >= kMaxLibraryDepth) at.disable_recursion_pending();
        std::error_code unknown;
        if (is_photometry_name(at->path().filename().string()) && !at->is_directory(unknown))
            paths.push_back(at->path().string());
    }
    std::sort(paths.begin(), paths.end());
    for (const std::string& path : paths) {
        if (ending_) return false;
        if (++files > kMaxLibraryFiles || !read_file(root, path, bytes)) {
            warn("the library has 5,000 files or 512 MiB: the rest, from '" + path + "' on, is left out");
            return false;
        }
    }
    return true;
}

Library::Row Library::read_row(const std::string& root, const std::string& path, const std::string& source,
                               const std::string& name, std::size_t& bytes) {
    Row made;
    const auto refuse = [&](const std::string& why) {
        made.row.set_name(name);
        made.row.set_source(source);
        made.row.set_error(why);
        made.words = lower(name);
    };
    const std::string real = real_below(root, path);
    if (real.empty()) {
        refuse("it is a link that leads nowhere or out of the folder");
    } else {
        const auto text = read_bounded_file(real, most_bytes(path));
        if (text) bytes += text->size();
        if (!text) {
            refuse("it " + text.error().message);
        } else if (text->size() > most_bytes(path)) {
            refuse("too_large: " + too_large(path));
        } else if (auto profile = exchange::read_luminaire(name, *text); !profile) {
            refuse(profile.error().text());
        } else {
            made = row_of(name, source, *profile);
            made.profile.reset();  // read again when it is wanted
        }
    }
    made.root = root;
    made.path = path;
    return made;
}

// Result: whether it had room.
bool Library::read_file(const std::string& root, const std::string& path, std::size_t& bytes) {
    const std::string name = shortened_text(fs::path(path).lexically_relative(root).generic_string(), kMaxNameBytes);
    Row made = read_row(root, path, root, name, bytes);
    if (bytes > kMaxLibraryBytes) return false;
    const std::lock_guard lock(mutex_);
    if (named(name) != nullptr) {
        made.row.clear_summary();
        made.row.clear_curve();
        made.row.set_error("another file of the library has this name");
    }
    files_.push_back(std::move(made));
    return true;
}

// Under the lock. Result: the row that can be used by this name.
const Library::Row* Library::named(const std::string& name) const {
    const auto find = [&](const auto& rows) -> const Row* {
        const auto at = std::ranges::find_if(
            rows, [&](const Row& row) { return row.row.error().empty() && row.row.name() == name; });
        return at == rows.end() ? nullptr : &*at;
    };
    if (const Row* row = find(built_in_)) return row;
    if (const Row* row = find(files_)) return row;
    if (const Row* row = find(uploads_)) return row;
    return find(kept_);
}

// Result: the file of "upload:NAME"; empty: there is none.
std::string Library::upload_of(const std::string& name) const {
    if (upload_folder_.empty() || !name.starts_with(kUploadPrefix)) return {};
    const std::string file = name.substr(kUploadPrefix.size());
    std::error_code failed;
    if (!is_upload_name(file) || !is_photometry_name(file) || !fs::is_regular_file(upload_folder_ + "/" + file, failed))
        return {};
    return upload_folder_ + "/" + file;
}

// Stand as long as the lock is held.
std::vector<std::string_view> Library::names() const {
    std::vector<std::string_view> names;
    const auto take = [&](const auto& rows) {
        for (const Row& row : rows)
            if (row.row.error().empty()) names.push_back(row.row.name());
    };
    take(built_in_), take(files_), take(uploads_), take(kept_);
    return names;
}

Result<v1::Library> Library::find(const v1::LibraryQuery& query) {
    if (const auto error = refused(query)) return *error;
    const std::vector<std::string> words = words_of(query.text());
    const std::uint32_t most = query.count() == 0 ? kDefaultLibraryRows : query.count();
    v1::Library found;
    const std::lock_guard lock(mutex_);
    if (query.read_again() && !folders_.empty()) {
        asked_ = true;
        wake_.notify_all();
    }
    if (!upload_folder_.empty() && changed(upload_folder_) != uploads_changed_) {
        uploads_asked_ = true;
        wake_.notify_all();
    }
    std::uint32_t matching = 0, listed = 0;
    // A luminaire that the scene came with is listed once, as the file that it is.
    const auto of_scene = [](const Row& row) { return row.row.source() == "scene"; };
    std::set<std::string> files;
    if (std::ranges::any_of(kept_, of_scene))
        for (const auto* rows : {&uploads_, &files_})
            for (const Row& row : *rows) files.insert(luminaire_key(row.row));
    const auto take = [&](const auto& rows) {
        for (const Row& row : rows) {
            if (of_scene(row) && files.contains(luminaire_key(row.row))) continue;
            ++listed;
            const bool matches = within(query, row.row) && std::ranges::all_of(words, [&](const std::string& word) {
                                     return row.words.find(word) != std::string::npos;
                                 });
            if (!matches || ++matching <= query.offset() || matching - query.offset() > most) continue;
            v1::LibraryRow& out = *found.add_rows() = row.row;
            if (!query.curves()) out.clear_curve();
        }
    };
    take(built_in_);
    take(kept_);
    take(uploads_);
    take(files_);
    found.set_found(matching);
    found.set_total(listed);
    found.set_reading(reading_ || asked_ || uploads_asked_);
    for (const std::string& warning : warnings_) found.add_warnings(warning);
    return found;
}

Result<std::shared_ptr<const Profile>> Library::profile(const std::string& name) const {
    std::string root, path;
    bool uploaded = false;
    {
        const std::lock_guard lock(mutex_);
        const Row* row = named(name);
        if (row != nullptr) {
            if (row->profile) return row->profile;
            root = row->root;
            path = row->path;
            uploaded = row->row.source() == "uploaded";
        } else if (const std::string file = upload_of(name); !file.empty()) {  // it came since they were read
            root = upload_folder_;
            path = file;
            uploaded = true;
        } else {
            return Error{"not_found", "profile", shortened_text(name, kMaxNameBytes),
                         with_hint("the library has no profile of this name", name, names())};
        }
    }
    const std::string real = real_below(root, path);
    if (real.empty()) return Error{"not_found", "profile", name, "the file is not there any more"};
    const auto text = read_bounded_file(real, most_bytes(path));
    if (!text) return Error{"file_unreadable", "profile", name, "the file " + text.error().message};
    if (text->size() > most_bytes(path)) return Error{"too_large", "profile", name, too_large(path)};
    const auto read = exchange::read_luminaire(uploaded ? name.substr(kUploadPrefix.size()) : name, *text);
    if (!read || !uploaded) return read;
    auto own = std::make_shared<Profile>(**read);
    own->uploaded = true;
    return std::shared_ptr<const Profile>(std::move(own));
}

void Library::keep_upload(const std::shared_ptr<const Profile>& profile) {
    const std::string name = std::string(kUploadPrefix) + profile->name;
    Row made = row_of(name, "uploaded", profile);
    const std::lock_guard lock(mutex_);
    std::erase_if(uploads_, [&](const Row& row) { return row.row.name() == name; });
    std::erase_if(kept_, [&](const Row& row) { return row.row.name() == name; });
    kept_.push_back(std::move(made));
    while (kept_.size() > kMaxKeptProfiles) kept_.pop_front();
}

void Library::keep_scene(const std::vector<std::shared_ptr<const Profile>>& profiles) {
    std::vector<Row> made;
    std::set<std::string> names;
    for (const auto& profile : profiles) {
        if (profile->uploaded) {
            keep_upload(profile);
            continue;
        }
        const auto built_in = builtin_profile(profile->name);
        // Of 1 cd, of 1 cd/m², or dark since its file could not be read: it is no luminaire.
        const std::string& format = profile->photometry.provenance.format;
        const bool plain = format == "KHR_lights_punctual" || format == "EXT_lights_area" || !(profile->peak_cd > 0.0);
        // Also as a saved show has it, whose figures were written and read.
        const bool ours = built_in && std::abs((*built_in)->flux_lm - profile->flux_lm) <= 1e-3 * profile->flux_lm;
        if (plain || ours || made.size() == kMaxKeptProfiles / 2) continue;
        if (!names.insert(profile->name).second) continue;
        made.push_back(row_of("scene:" + profile->name, "scene", profile));
    }
    const std::lock_guard lock(mutex_);
    std::erase_if(kept_, [](const Row& row) { return row.row.source() == "scene"; });
    for (Row& row : made) kept_.push_back(std::move(row));
    while (kept_.size() > kMaxKeptProfiles) kept_.pop_front();
}

}  // namespace gonio
