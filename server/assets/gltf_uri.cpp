// URIs of a glTF file -> bytes: data: URIs, and files beside the glTF.
#include <algorithm>
#include <array>
#include <charconv>
#include <cstdint>
#include <fstream>
#include <optional>
#include <system_error>

#include "ies/core/decomposed_text.h"
#include "server/assets/assets.h"
#include "server/assets/gltf_document.h"

namespace gonio {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostNamesSeen = 65'536;  // of a folder, while a name that is spelt otherwise is looked for

// RFC 3986, 2.1. A '%' without two digits stays as it is: some exporters write file names unencoded.
std::string percent_decoded(std::string_view text) {
    std::string result;
    for (std::size_t i = 0; i < text.size(); ++i) {
        const char* digits = text.data() + i + 1;
        unsigned char byte = 0;
        if (text[i] == '%' && i + 2 < text.size() && std::from_chars(digits, digits + 2, byte, 16).ptr == digits + 2) {
            result += static_cast<char>(byte);
            i += 2;
        } else {
            result += text[i];
        }
    }
    return result;
}

// RFC 4648, 4. Result: nothing if a character is not of the alphabet; white space is skipped.
std::optional<std::vector<std::byte>> base64_decoded(std::string_view text) {
    static const std::array<std::int8_t, 256> values = [] {
        std::array<std::int8_t, 256> table;
        table.fill(-1);
        constexpr std::string_view alphabet = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
        for (std::size_t i = 0; i < alphabet.size(); ++i) {
            table[static_cast<unsigned char>(alphabet[i])] = static_cast<std::int8_t>(i);
        }
        return table;
    }();
    std::vector<std::byte> result;
    result.reserve(text.size() / 4 * 3 + 3);
    std::uint32_t held = 0;
    int bits = 0;
    bool padded = false;
    for (const char c : text) {
        if (c == ' ' || c == '\n' || c == '\r' || c == '\t') continue;
        if (c == '=') {
            padded = true;
            continue;
        }
        const signed char value = values[static_cast<unsigned char>(c)];
        if (value < 0 || padded) return std::nullopt;
        held = (held << 6 | static_cast<std::uint32_t>(value)) & 0xffffffu;
        bits += 6;
        if (bits >= 8) {
            bits -= 8;
            result.push_back(static_cast<std::byte>(held >> bits & 0xffu));
        }
    }
    return result;
}

// Whether the texts are the same but for capitals of ASCII.
bool same_letters(std::string_view a, std::string_view b) {
    const auto lower = [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c + ('a' - 'A')) : c; };
    return std::equal(a.begin(), a.end(), b.begin(), b.end(), [&](char x, char y) { return lower(x) == lower(y); });
}

bool ends_with_base64(std::string_view header) {
    constexpr std::string_view mark = ";base64";
    return header.size() >= mark.size() && same_letters(header.substr(header.size() - mark.size()), mark);
}

Result<std::vector<std::byte>> read_data_uri(const std::string& uri, const std::string& where, std::size_t limit,
                                             std::size_t hard_limit) {
    const std::size_t comma = uri.find(',');
    if (comma == std::string::npos) return Error{"bad_gltf", where, shown_uri(uri), "a data URI without a comma"};
    const std::string_view header = std::string_view(uri).substr(0, comma),
                           payload = std::string_view(uri).substr(comma + 1);
    std::vector<std::byte> bytes;
    if (ends_with_base64(header)) {
        // Some writers percent-encode '+' and '/' of the payload; the alphabet itself has no '%'.
        auto decoded = base64_decoded(payload.find('%') == std::string_view::npos ? payload : percent_decoded(payload));
        if (!decoded) return Error{"bad_gltf", where, shown_uri(uri), "a data URI whose base64 is malformed"};
        bytes = std::move(*decoded);
    } else {
        const std::string text = percent_decoded(payload);
        const auto* first = reinterpret_cast<const std::byte*>(text.data());
        bytes.assign(first, first + text.size());
    }
    if (bytes.size() > hard_limit) return Error{"too_large", where, shown_uri(uri), "the embedded file is too large"};
    bytes.resize(std::min(bytes.size(), limit));
    return bytes;
}

bool has_scheme(const std::string& uri) {
    const std::size_t colon = uri.find(':');
    return colon != std::string::npos && uri.find_first_of("/ %") > colon &&
           uri.find_first_not_of("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789+-.") == colon;
}

// True if `file`, with every link followed, lies under `directory`.
bool is_inside(const fs::path& directory, const fs::path& file) {
    std::error_code failed;
    const fs::path root = fs::canonical(directory, failed);
    if (failed) return false;
    const fs::path real = fs::weakly_canonical(file, failed);
    if (failed) return false;
    return std::mismatch(root.begin(), root.end(), real.begin(), real.end()).first == root.end();
}

bool is_ascii(std::string_view text) {
    return std::all_of(text.begin(), text.end(), [](char c) { return static_cast<unsigned char>(c) < 0x80; });
}

// The file of this name whose accents are spelt otherwise: in one character with their letter or in two, as some file
// systems and archives turn one into the other. Result: its path from the directory; none where there is no such file.
std::optional<fs::path> spelt_otherwise(const fs::path& directory, const fs::path& relative) {
    fs::path found;
    std::error_code failed;
    for (const fs::path& part : relative) {
        if (fs::exists(directory / found / part, failed)) {
            found /= part;
            continue;
        }
        const std::string wanted = decomposed_text(part.string());
        if (is_ascii(wanted)) return std::nullopt;                          // it has no other spelling
        if (!is_inside(directory, directory / found)) return std::nullopt;  // nothing outside is listed
        std::optional<fs::path> other;
        std::size_t seen = 0;
        for (fs::directory_iterator entry(directory / found, failed), end; !failed && entry != end && !other;
             entry.increment(failed)) {
            if (++seen > kMostNamesSeen) break;
            const fs::path name = entry->path().filename();
            if (decomposed_text(name.string()) == wanted) other = name;
        }
        if (!other) return std::nullopt;
        found /= *other;
    }
    return found;
}

}  // namespace

bool is_data_uri(std::string_view uri) {
    constexpr std::string_view scheme = "data:";
    return same_letters(uri.substr(0, scheme.size()), scheme);
}

std::string shown_uri(const std::string& uri) {
    return uri.size() > 80 ? uri.substr(0, 77) + "..." : uri;
}

Result<fs::path> file_of_uri(const fs::path& directory, const std::string& uri, const std::string& where) {
    const auto refused = [&](const char* code, std::string message) {
        return Error{code, where, shown_uri(uri), std::move(message)};
    };
    if (has_scheme(uri)) return refused("unsupported", "only data: URIs and relative file references are read");
    if (directory.empty()) return refused("missing_file", "files beside this one are not read");
    std::error_code failed;
    // Decoded first, as the specification says; then as written, for exporters that do not encode.
    std::vector<std::string> names{percent_decoded(uri)};
    if (names.front() != uri) names.push_back(uri);
    for (const std::string& name : names) {
        if (name.empty() || name.size() > 4096 || name.find('\0') != std::string::npos) {
            return refused("bad_gltf", "the URI names no file");
        }
        const fs::path relative = fs::path(name).lexically_normal();
        if (relative.is_absolute() || *relative.begin() == "..") {
            return refused("bad_gltf", "the URI leaves the directory of the glTF file");
        }
        const fs::path file = directory / relative;
        const std::optional<fs::path> written =
            fs::exists(file, failed) ? relative : spelt_otherwise(directory, relative);
        if (!written) continue;
        if (!is_inside(directory, directory / *written))
            return refused("bad_gltf", "the URI leaves the directory of the glTF file");
        if (!fs::is_regular_file(directory / *written, failed))
            return refused("bad_gltf", "the URI does not name a regular file");
        return *written;
    }
    return refused("missing_file", "the file is missing");
}

Result<std::vector<std::byte>> read_uri(const fs::path& directory, const std::string& uri, const std::string& where,
                                        std::size_t limit, std::size_t hard_limit) {
    if (is_data_uri(uri)) return read_data_uri(uri, where, limit, hard_limit);
    const auto relative = file_of_uri(directory, uri, where);
    if (!relative) return relative.error();
    const auto refused = [&](const char* code, std::string message) {
        return Error{code, where, shown_uri(uri), std::move(message)};
    };
    const fs::path file = directory / *relative;
    std::error_code failed;
    const std::uintmax_t size = fs::file_size(file, failed);
    if (failed) return refused("missing_file", "the file is missing");
    if (size > hard_limit) return refused("too_large", "the file has " + std::to_string(size) + " bytes");
    std::vector<std::byte> bytes(std::min<std::uintmax_t>(size, limit));
    std::ifstream stream(file, std::ios::binary);
    stream.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
    if (!stream || static_cast<std::size_t>(stream.gcount()) != bytes.size()) {
        return refused("missing_file", "the file cannot be read");
    }
    return bytes;
}

}  // namespace gonio
