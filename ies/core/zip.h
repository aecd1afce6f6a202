// Zip archives from outside, in memory and within limits; and writing them, the same bytes each time. The format is
// that of PKWARE's APPNOTE 6.3; the work is libzip's.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "ies/core/result.h"

namespace gonio {

// Beyond these an archive or an entry is refused. Sizes are those that the archive declares; an entry that unpacks to
// another size is refused as well ("zip_damaged"), so none takes more memory than it declared.
struct ZipLimits {
    std::uint64_t archive_bytes = std::uint64_t{1} << 30;  // of the archive itself: "zip_too_large"
    std::size_t entries = 10'000;                          // "zip_too_many_entries"
    std::uint64_t total_bytes = std::uint64_t{4} << 30;    // of all entries, unpacked: "zip_total_too_large"
    std::uint64_t entry_bytes = 256u << 20;                // of one entry, unpacked: "zip_entry_too_large"
    // Unpacked bytes for each packed one: "zip_ratio". DEFLATE reaches 1,032. Small entries may have any.
    std::uint64_t ratio = 200;
    std::uint64_t any_ratio_bytes = 1u << 20;
};

struct ZipEntry {
    // UTF-8, with '/' between folders and at the end of a folder's own name; "./" and empty parts are taken out. Names
    // that are not UTF-8 are taken as code page 437, as the format has it.
    std::string name;
    std::string raw_name;  // the bytes in the archive: some writers use other code pages
    std::uint64_t bytes = 0;
    std::uint64_t packed_bytes = 0;
    bool is_folder() const { return name.ends_with('/'); }
};

// An archive that was opened. It may be moved, and used by one thread at a time.
class ZipArchive {
public:
    ZipArchive();
    ZipArchive(ZipArchive&&) noexcept;
    ZipArchive& operator=(ZipArchive&&) noexcept;
    ~ZipArchive();

    // In the order of the archive. No two have the same name.
    const std::vector<ZipEntry>& entries() const { return entries_; }

    // Result: the entry of this name, nullptr where there is none.
    const ZipEntry* find(std::string_view name) const;

    // Names that differ from an earlier entry's by the case of ASCII letters only, in the order of the archive. On some
    // systems both are one file: readers that write to disk, or look names up without regard to case, must tell.
    const std::vector<std::string>& case_clashes() const { return case_clashes_; }

    // Result: the bytes of the entry of this name. Reading it again is allowed. Errors, each with the name as place:
    // zip_no_such_entry (also for folders), zip_entry_too_large, zip_ratio, zip_encrypted, zip_method (neither stored
    // nor deflated), zip_crc, zip_damaged.
    Result<std::string> read(std::string_view name) const;

private:
    struct Opened;
    friend Result<ZipArchive> open_zip(std::string bytes, const ZipLimits& limits);

    std::unique_ptr<Opened> opened_;
    std::vector<ZipEntry> entries_;
    std::vector<std::size_t> by_name_;  // indices of entries_, ascending by name
    std::vector<std::string> case_clashes_;
};

// Result: whether the bytes begin as an archive does, an empty one too.
inline bool looks_like_zip(std::string_view bytes) {
    return bytes.starts_with("PK\x03\x04") || bytes.starts_with("PK\x05\x06");
}

// Result: the archive; it keeps the bytes. Nothing is unpacked yet. Errors of the whole: zip_too_large,
// zip_too_many_entries, and not_a_zip (no archive, or its directory is damaged). Errors with an entry's name as place:
// - zip_total_too_large; zip_overlap: entries share packed bytes; zip_duplicate_name.
// - zip_bad_name: empty, absolute, with a drive, ".." or control characters, longer than 1,024 bytes. Backslashes count
//   as '/', and a zero byte ends a name.
Result<ZipArchive> open_zip(std::string bytes, const ZipLimits& limits = {});

struct ZipFile {
    std::string name;
    std::string bytes;
    bool deflated = true;  // false: stored as it is
};

// Result: an archive of the files in this order, dated 1980-01-01. The same files give the same bytes (with one version
// of zlib). Errors: zip_bad_name, zip_duplicate_name as above; zip_write where libzip refuses.
Result<std::string> write_zip(std::span<const ZipFile> files);

}  // namespace gonio
