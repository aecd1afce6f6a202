#include "ies/core/zip.h"

#include <zip.h>

#include <algorithm>
#include <cstring>
#include <numeric>
#include <optional>
#include <unordered_set>

#include "ies/core/text.h"

namespace gonio {
namespace {

constexpr std::size_t kMaxNameBytes = 1024;
constexpr std::size_t kShownNameBytes = 200;

Error error_of(std::string code, std::string_view name, std::string value, std::string message) {
    return {std::move(code), name.empty() ? "zip archive" : shown_text(name, kShownNameBytes), std::move(value),
            std::move(message)};
}

bool is_control(char c) {
    return static_cast<unsigned char>(c) < 0x20 || c == 0x7F;
}

// Result: the name as ZipEntry has it, empty where it is none.
std::string plain_name(std::string name) {
    if (name.empty() || name.size() > kMaxNameBytes) return {};
    for (char& c : name) {
        if (is_control(c)) return {};
        if (c == '\\') c = '/';
    }
    const bool drive = name.size() >= 2 && name[1] == ':' && ((name[0] | 0x20) >= 'a' && (name[0] | 0x20) <= 'z');
    if (name.front() == '/' || drive) return {};
    std::string result;
    for (std::size_t at = 0; at < name.size();) {
        const std::size_t end = std::min(name.find('/', at), name.size());
        const std::string_view part = std::string_view(name).substr(at, end - at);
        if (part == "..") return {};
        if (!part.empty() && part != ".") {
            result += part;
            if (end < name.size()) result += '/';
        }
        at = end + 1;
    }
    return result;
}

Error bad_name(std::string_view name) {
    return error_of("zip_bad_name", name, {},
                    "the name is empty, absolute, too long, leads out of the archive or has control characters");
}

Error duplicate_name(std::string_view name) {
    return error_of("zip_duplicate_name", name, {}, "two entries have this name");
}

// A folder's entry and a file's may not share a name either.
std::string_view without_slash(std::string_view name) {
    return name.ends_with('/') ? name.substr(0, name.size() - 1) : name;
}

std::string lower_ascii(std::string_view name) {
    std::string result(name);
    for (char& c : result)
        if (c >= 'A' && c <= 'Z') c = static_cast<char>(c | 0x20);
    return result;
}

// Result: whether the archive's directory may have more than `most` entries: libzip takes memory for each before it
// tells how many there are. Archives within the archive count along, so there may be 16 times as many.
bool has_many_entries(std::string_view bytes, std::size_t most) {
    constexpr std::string_view kDirectoryEntry = "PK\x01\x02";
    const std::size_t enough = 16 * most + 1000;
    std::size_t found = 0;
    for (std::size_t at = bytes.find(kDirectoryEntry); at != std::string_view::npos && found <= enough; ++found)
        at = bytes.find(kDirectoryEntry, at + kDirectoryEntry.size());
    return found > enough;
}

struct CloseFile {
    void operator()(zip_file_t* file) const { zip_fclose(file); }
};

}  // namespace

struct ZipArchive::Opened {
    std::string bytes;
    zip_t* archive = nullptr;
    ZipLimits limits;

    ~Opened() {
        if (archive) zip_discard(archive);
    }
};

ZipArchive::ZipArchive() = default;
ZipArchive::ZipArchive(ZipArchive&&) noexcept = default;
ZipArchive& ZipArchive::operator=(ZipArchive&&) noexcept = default;
ZipArchive::~ZipArchive() = default;

Result<ZipArchive> open_zip(std::string bytes, const ZipLimits& limits) {
    if (bytes.size() > limits.archive_bytes)
        return error_of("zip_too_large", {}, std::to_string(bytes.size()),
                        "the archive has more than " + std::to_string(limits.archive_bytes) + " bytes");
    const Error too_many = error_of("zip_too_many_entries", {}, {},
                                    "the archive has more than " + std::to_string(limits.entries) + " entries");
    if (has_many_entries(bytes, limits.entries)) return too_many;
    if (bytes.empty())  // for libzip an archive without entries
        return error_of("not_a_zip", {}, {}, "there are no bytes");
    ZipArchive result;
    result.opened_ = std::make_unique<ZipArchive::Opened>();
    ZipArchive::Opened& opened = *result.opened_;
    opened.bytes = std::move(bytes);
    opened.limits = limits;
    zip_error_t fault;
    zip_error_init(&fault);
    zip_source_t* source = zip_source_buffer_create(opened.bytes.data(), opened.bytes.size(), 0, &fault);
    if (source) opened.archive = zip_open_from_source(source, ZIP_RDONLY, &fault);
    if (!opened.archive) {
        const std::string reason = zip_error_strerror(&fault);
        if (source) zip_source_free(source);
        zip_error_fini(&fault);
        return error_of("not_a_zip", {}, reason, "this is no zip archive, or its directory is damaged");
    }
    zip_error_fini(&fault);

    const auto count = static_cast<std::uint64_t>(std::max<zip_int64_t>(zip_get_num_entries(opened.archive, 0), 0));
    if (count > limits.entries) return too_many;
    std::uint64_t total = 0;
    std::uint64_t packed = 0;
    std::unordered_set<std::string> names;
    std::unordered_set<std::string> lower_names;
    for (std::uint64_t i = 0; i < count; ++i) {
        zip_stat_t stat;
        const char* raw = zip_get_name(opened.archive, i, ZIP_FL_ENC_RAW);
        ZipEntry entry;
        if (raw) entry.raw_name = raw;
        const char* name = zip_get_name(opened.archive, i, ZIP_FL_ENC_GUESS);
        // In code page 437 control characters are signs as well: U+263A for 1.
        if (!std::ranges::any_of(entry.raw_name, is_control)) entry.name = plain_name(name ? name : "");
        if (entry.name.empty()) return bad_name(entry.raw_name);
        if (zip_stat_index(opened.archive, i, 0, &stat) != 0 || !(stat.valid & ZIP_STAT_SIZE) ||
            !(stat.valid & ZIP_STAT_COMP_SIZE))
            return error_of("not_a_zip", entry.name, {}, "the archive does not tell the entry's size");
        entry.bytes = stat.size;
        entry.packed_bytes = stat.comp_size;
        if (!names.emplace(without_slash(entry.name)).second) return duplicate_name(entry.name);
        if (!lower_names.insert(lower_ascii(without_slash(entry.name))).second)
            result.case_clashes_.push_back(entry.name);
        if (entry.bytes > limits.total_bytes - total)
            return error_of("zip_total_too_large", entry.name, std::to_string(entry.bytes),
                            "with this entry all have more than " + std::to_string(limits.total_bytes) + " bytes");
        total += entry.bytes;
        if (entry.packed_bytes > opened.bytes.size() - packed)
            return error_of("zip_overlap", entry.name, std::to_string(entry.packed_bytes),
                            "with this entry all have more packed bytes than the archive");
        packed += entry.packed_bytes;
        result.entries_.push_back(std::move(entry));
    }
    result.by_name_.resize(result.entries_.size());
    std::iota(result.by_name_.begin(), result.by_name_.end(), std::size_t{0});
    std::ranges::sort(result.by_name_, {},
                      [&](std::size_t i) -> const std::string& { return result.entries_[i].name; });
    return result;
}

const ZipEntry* ZipArchive::find(std::string_view name) const {
    const auto at =
        std::ranges::lower_bound(by_name_, name, {}, [&](std::size_t i) { return std::string_view(entries_[i].name); });
    return at != by_name_.end() && entries_[*at].name == name ? &entries_[*at] : nullptr;
}

Result<std::string> ZipArchive::read(std::string_view name) const {
    const ZipEntry* entry = find(name);
    if (!entry || entry->is_folder()) return error_of("zip_no_such_entry", name, {}, "the archive has no such file");
    const ZipLimits& limits = opened_->limits;
    const std::string size = std::to_string(entry->bytes);
    if (entry->bytes > limits.entry_bytes)
        return error_of("zip_entry_too_large", name, size,
                        "the file has more than " + std::to_string(limits.entry_bytes) + " bytes");
    if (entry->bytes > limits.any_ratio_bytes && entry->bytes / limits.ratio > entry->packed_bytes)
        return error_of("zip_ratio", name, size + " of " + std::to_string(entry->packed_bytes),
                        "the file is packed more than " + std::to_string(limits.ratio) + " times");
    const auto index = static_cast<zip_uint64_t>(entry - entries_.data());
    zip_stat_t stat;
    if (zip_stat_index(opened_->archive, index, 0, &stat) != 0)
        return error_of("zip_damaged", name, {}, "the file cannot be unpacked");
    if (stat.valid & ZIP_STAT_ENCRYPTION_METHOD && stat.encryption_method != ZIP_EM_NONE)
        return error_of("zip_encrypted", name, {}, "the file is encrypted");
    if (stat.comp_method != ZIP_CM_STORE && stat.comp_method != ZIP_CM_DEFLATE)
        return error_of("zip_method", name, std::to_string(stat.comp_method),
                        "the file is packed by a method other than store and deflate");

    const auto damaged = [&](zip_error_t* fault) {
        const int code = zip_error_code_zip(fault);
        const std::string reason = zip_error_strerror(fault);
        if (code == ZIP_ER_CRC) return error_of("zip_crc", name, {}, "the file's checksum is not that of its bytes");
        return error_of("zip_damaged", name, reason, "the file cannot be unpacked");
    };
    const std::unique_ptr<zip_file_t, CloseFile> file(zip_fopen_index(opened_->archive, index, 0));
    if (!file) return damaged(zip_get_error(opened_->archive));
    // Memory grows with what is unpacked, not with what is declared; one byte more than declared shows a lie.
    std::string bytes;
    constexpr std::size_t kStep = 1u << 20;
    while (bytes.size() <= entry->bytes) {
        const std::size_t have = bytes.size();
        const auto wanted = static_cast<std::size_t>(std::min<std::uint64_t>(kStep, entry->bytes - have + 1));
        bytes.resize(have + wanted);
        const zip_int64_t got = zip_fread(file.get(), bytes.data() + have, wanted);
        if (got < 0) return damaged(zip_file_get_error(file.get()));
        bytes.resize(have + static_cast<std::size_t>(got));
        if (got == 0) break;
    }
    if (bytes.size() != entry->bytes)
        return error_of("zip_damaged", name, std::to_string(bytes.size()), "the file has another size than declared");
    return bytes;
}

Result<std::string> write_zip(std::span<const ZipFile> files) {
    std::unordered_set<std::string> names;
    for (const ZipFile& file : files) {
        const std::string name = plain_name(file.name);
        if (name != file.name || name.empty()) return bad_name(file.name);
        if (!names.emplace(without_slash(name)).second) return duplicate_name(name);
    }
    // libzip drops an archive without entries: its directory's end, as APPNOTE 4.3.16 has it.
    if (files.empty()) return std::string("PK\x05\x06", 4) + std::string(18, '\0');

    zip_error_t fault;
    zip_error_init(&fault);
    const auto refusal = [&](std::string_view name) {
        Error error = error_of("zip_write", name, zip_error_strerror(&fault), "the archive cannot be written");
        zip_error_fini(&fault);
        return error;
    };
    zip_source_t* target = zip_source_buffer_create(nullptr, 0, 0, &fault);
    if (!target) return refusal({});
    zip_t* archive = zip_open_from_source(target, ZIP_TRUNCATE, &fault);
    if (!archive) {
        zip_source_free(target);
        return refusal({});
    }
    zip_source_keep(target);
    const auto add = [&](const ZipFile& file) {
        zip_source_t* source = zip_source_buffer(archive, file.bytes.data(), file.bytes.size(), 0);
        if (!source) return false;
        const zip_int64_t index = zip_file_add(archive, file.name.c_str(), source, ZIP_FL_ENC_UTF_8);
        if (index < 0) {
            zip_source_free(source);
            return false;
        }
        constexpr zip_uint16_t kJanuary1980 = 1u << 5 | 1u;
        const auto at = static_cast<zip_uint64_t>(index);
        return zip_file_set_dostime(archive, at, 0, kJanuary1980, 0) == 0 &&
               zip_set_file_compression(archive, at, file.deflated ? ZIP_CM_DEFLATE : ZIP_CM_STORE, 0) == 0;
    };
    std::optional<std::string_view> refused;
    for (const ZipFile& file : files)
        if (!refused && !add(file)) refused = file.name;
    if (!refused && zip_close(archive) != 0) refused = std::string_view();
    if (refused) {
        zip_error_t* reason = zip_get_error(archive);
        zip_error_set(&fault, zip_error_code_zip(reason), zip_error_code_system(reason));
        zip_discard(archive);
        zip_source_free(target);
        return refusal(*refused);
    }
    std::string bytes;
    zip_stat_t stat;
    bool read = zip_source_stat(target, &stat) == 0 && zip_source_open(target) == 0;
    if (read) {
        bytes.resize(stat.size);
        read = zip_source_read(target, bytes.data(), bytes.size()) == static_cast<zip_int64_t>(bytes.size());
        zip_source_close(target);
    }
    if (!read) {
        zip_source_free(target);
        return refusal({});
    }
    zip_source_free(target);
    zip_error_fini(&fault);
    return bytes;
}

}  // namespace gonio
