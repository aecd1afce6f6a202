// What of a sequence is on the disk. Each file that is complete has an entry, a small file of its own: several shards
// may write at once, also over a network. Files and entries are there whole or not at all. Any thread; it takes as
// long as the disk.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "ies/core/result.h"

namespace gonio::sequence {

inline constexpr const char* kManifestFolder = "manifest";     // in the output folder; manifest/NAME.json
inline constexpr const char* kManifestFile = "manifest.json";  // all entries, once every frame is there
inline constexpr std::size_t kMaxEntryBytes = 1u << 16;

// What made a file.
struct Maker {
    std::string job;      // SHA-256 of all that the frames depend on
    std::string version;  // of goniod
    std::string isa;      // of rays and lighting: "avx2", "avx512", …
    std::string gl, cpu;  // gl: empty where no GL was used
};

struct Entry {
    std::string name;  // of the file, in the output folder
    int frame = -1;    // -1: the video
    double t_s = 0.0;
    unsigned scene_rev = 0;
    std::string sha256;
    std::size_t bytes = 0;
    std::string from;  // of the video: SHA-256 of its frames' hashes
    Maker maker;
};

// Writes a file of the folder, then its entry: each under another name first, ".NAME.tmp.HOST.PID", which is brought to
// the disk and renamed. Folders are made. Errors: "file_unwritable".
Result<bool> write_file(const std::string& folder, const std::string& name, std::string_view bytes);
Result<bool> write_entry(const std::string& folder, const Entry& entry);
// Result: the other name, of this process, in the same folder.
std::string part_name(const std::string& path);
// Makes what somebody wrote as part_name(path) the file. Errors: "file_unwritable".
Result<bool> finish_part(const std::string& path);
// Removes other names that processes of this machine left which are no more: where files like this one are, and where
// their entries are.
void remove_left_parts(const std::string& folder, const std::string& name);

// Result: the entry of a file that is complete: its job is this one, by this version, and the file's bytes are those
// that it says.
std::optional<Entry> complete_entry(const std::string& folder, const std::string& name, const Maker& maker);

// Result: the text of kManifestFile. The same entries make the same text.
std::string manifest_text(const std::vector<Entry>& entries);

// Result: the processor's name, as /proc/cpuinfo has it.
std::string cpu_name();

}  // namespace gonio::sequence
