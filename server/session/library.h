// The library of photometry: the profiles that lights can have by name. Built-in luminaires, the files of folders, what
// clients have uploaded, and what the lights of the scene came with. Files are read on a thread of its own.
#pragma once

#include <atomic>
#include <condition_variable>
#include <deque>
#include <filesystem>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "ies/core/result.h"
#include "protocol/schema/library.pb.h"
#include "protocol/schema/messages.h"
#include "server/scene/profile.h"

namespace gonio {

inline constexpr std::size_t kMaxLibraryFiles = 5000;                    // of all folders; the rest is left out
inline constexpr std::size_t kMaxLibraryBytes = std::size_t{512} << 20;  // of all files, each at most 1 MiB
inline constexpr std::size_t kMaxContainerBytes =
    std::size_t{32} << 20;  // but of a .gldf, .gdtf or .zip, which has pictures and models
inline constexpr std::size_t kMaxLibraryEntries = 100'000;  // of folders that are looked through
inline constexpr int kMaxLibraryDepth = 16;                 // of folders in folders
inline constexpr std::size_t kMaxKeptProfiles = 200;        // uploaded and of the scene; the oldest goes
inline constexpr std::uint32_t kMaxLibraryRows = 500, kDefaultLibraryRows = 100;  // of an answer

class Library {
public:
    // folders: files of kPhotometryEndings below them, links followed only to files that lie below too. Begins to read
    // them. upload_folder: of "upload:NAME", read again where find() sees that files came or went; empty: there is
    // none.
    explicit Library(std::vector<std::string> folders = {}, std::string upload_folder = {});
    ~Library();
    Library(const Library&) = delete;
    Library& operator=(const Library&) = delete;

    // Result: the rows that the query asks for, of what has been read so far. Errors: "invalid_argument" (count,
    // bounds). Any thread; a look at each row.
    Result<v1::Library> find(const v1::LibraryQuery& query);
    // Result: the profile of a row's name; a file of a folder is read now. Errors: "not_found"; of make_profile,
    // "file_unreadable", "too_large". Any thread but the render thread.
    Result<std::shared_ptr<const Profile>> profile(const std::string& name) const;
    // A client has uploaded it with a command, or a show brought it. One of the same name gives way. Any thread; takes
    // as long as summary_of().
    void keep_upload(const std::shared_ptr<const Profile>& profile);
    // Those that the scene's lights came with: they take the place of an earlier scene's, uploads among them are kept
    // as such. Likewise.
    void keep_scene(const std::vector<std::shared_ptr<const Profile>>& profiles);

private:
    struct Row {
        v1::LibraryRow row;
        std::string words;                       // lower case, what a search looks at
        std::string root, path;                  // of a file
        std::shared_ptr<const Profile> profile;  // else
    };
    void work();
    void read_folders();
    void read_uploads();
    bool read_folder(const std::string& root, std::size_t& files, std::size_t& bytes);
    bool read_file(const std::string& root, const std::string& path, std::size_t& bytes);
    static Row read_row(const std::string& root, const std::string& path, const std::string& source,
                        const std::string& name, std::size_t& bytes);
    void warn(std::string text);
    const Row* named(const std::string& name) const;
    std::string upload_of(const std::string& name) const;
    std::vector<std::string_view> names() const;
    static Row row_of(std::string name, std::string source, std::shared_ptr<const Profile> profile);

    const std::vector<std::string> folders_;
    const std::string upload_folder_;
    mutable std::mutex mutex_;  // of all that follows
    std::condition_variable wake_;
    std::vector<Row> built_in_, files_, uploads_;      // uploads_: files of the upload folder
    std::filesystem::file_time_type uploads_changed_;  // when they were read, of the folder
    std::deque<Row> kept_;
    std::vector<std::string> warnings_;
    bool asked_ = false, reading_ = false, uploads_asked_ = false;
    std::atomic<bool> ending_{false};
    std::thread thread_;
};

}  // namespace gonio
