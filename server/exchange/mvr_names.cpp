// What shows call files, objects and addresses, as exporters write it.
#include <algorithm>
#include <cctype>

#include "ies/core/decomposed_text.h"
#include "server/exchange/mvr.h"
#include "server/exchange/xml_read.h"

namespace gonio::mvr {
namespace {

// Result: what names are compared by: small letters, accents apart from them. Programs on a Mac write "ü" as "u" and
// dots.
std::string folded(std::string_view text) {
    std::string result = decomposed_text(text);
    for (char& c : result) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    return result;
}

// Without folders.
std::string_view file_of(std::string_view name) {
    const std::size_t slash = name.find_last_of("/\\");
    return exchange::trimmed(slash == std::string_view::npos ? name : name.substr(slash + 1));
}

}  // namespace

EntryIndex::EntryIndex(std::span<const std::string> entries) {
    for (const std::string& entry : entries) {
        exact_.emplace(entry, entry);
        loose_.emplace(folded(file_of(entry)), entry);
    }
}

EntryIndex::Found EntryIndex::find(std::string_view name, std::string_view extension) const {
    std::string path(name);
    std::replace(path.begin(), path.end(), '\\', '/');  // as in the names of entries
    const std::string file = folded(file_of(path));
    if (file.empty() || file.starts_with('.')) return {};
    // Names have dots in them: an extension that is not the one is a part of the name.
    for (const std::string& tail : {std::string(), std::string(extension)}) {
        if (!extension.empty() && tail.empty() && !file.ends_with(extension)) continue;
        if (const auto found = exact_.find(path + tail); found != exact_.end()) return {found->second, true};
        if (const auto found = loose_.find(file + tail); found != loose_.end()) return {found->second, false};
    }
    return {};
}

std::string plain_uuid(std::string_view text) {
    std::string digits;
    for (const char c : text) {
        if (std::isxdigit(static_cast<unsigned char>(c)))
            digits += static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
        else if (c != ' ' && c != '-' && c != '{' && c != '}')
            return std::string(exchange::trimmed(text));
    }
    if (digits.size() != 32) return std::string(exchange::trimmed(text));
    for (const std::size_t at : {8u, 13u, 18u, 23u}) digits.insert(at, 1, '-');
    return digits;
}

std::optional<Address> address_of(std::string_view text) {
    text = exchange::trimmed(text);
    const std::size_t dot = text.find('.');
    const auto first = exchange::whole_number_of(text.substr(0, dot));
    if (!first || *first < 1 || *first > 512ll * kMostUniverse) return std::nullopt;
    if (dot == std::string_view::npos)
        return Address{static_cast<unsigned>((*first - 1) / 512 + 1), static_cast<unsigned>((*first - 1) % 512 + 1)};
    const auto second = exchange::whole_number_of(text.substr(dot + 1));
    if (*first > kMostUniverse || !second || *second < 1 || *second > 512) return std::nullopt;
    return Address{static_cast<unsigned>(*first), static_cast<unsigned>(*second)};
}

}  // namespace gonio::mvr
