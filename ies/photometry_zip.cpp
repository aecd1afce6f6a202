#include "ies/photometry_zip.h"

#include <algorithm>
#include <array>
#include <string>
#include <vector>

#include "ies/core/text.h"
#include "ies/core/zip.h"
#include "ies/gldf.h"
#include "ies/photometry_file.h"
#include "ies/text_scan.h"

namespace gonio::ies::detail {

namespace {

constexpr std::size_t kListed = 8;         // names in an error
constexpr std::size_t kMostLookedAt = 64;  // .xml files whose root is looked for
constexpr const char* kProduct = "product.xml";

std::string_view file_name(std::string_view path) {
    return path.substr(path.rfind('/') + 1);  // npos + 1 is 0
}

bool ends_in(std::string_view name, std::string_view ending) {
    return to_upper(name).ends_with(ending);
}

// Not what macOS puts beside each file.
bool is_hidden(std::string_view path) {
    return path.starts_with("__MACOSX/") || file_name(path).starts_with('.');
}

bool has_tm33_root(std::string_view text) {
    const std::string_view head = text.substr(0, 4096);
    return head.find("<IESTM33") != std::string_view::npos ||
           head.find("<LuminaireOpticalData") != std::string_view::npos;
}

std::vector<std::string> photometric_files(const ZipArchive& archive) {
    std::vector<std::string> found;
    std::size_t looked_at = 0;
    for (const ZipEntry& entry : archive.entries()) {
        if (entry.is_folder() || is_hidden(entry.name)) continue;
        const bool plain = std::ranges::any_of(std::array{".IES", ".LDT", ".IESXML"},
                                               [&](const char* ending) { return ends_in(entry.name, ending); });
        if (!plain) {
            if (!ends_in(entry.name, ".XML") || ++looked_at > kMostLookedAt) continue;
            const auto text = archive.read(entry.name);
            if (!text || !has_tm33_root(*text)) continue;
        }
        found.push_back(entry.name);
    }
    return found;
}

std::string listed(const std::vector<std::string>& names) {
    std::string text;
    for (std::size_t i = 0; i < std::min(names.size(), kListed); ++i)
        text += (i > 0 ? ", " : "") + shown_text(names[i], 60);
    return names.size() > kListed ? text + ", ..." : text;
}

// What else the archive is, by the file that each of these formats must have, in a folder too.
std::optional<Error> other_archive(const ZipArchive& archive) {
    struct Kind {
        std::string_view file;
        std::string_view content;
        const char* message;
    };
    constexpr Kind kKinds[] = {
        {"description.xml", "<GDTF", "the file is a GDTF fixture, no photometric file"},
        {"GeneralSceneDescription.xml", "<GeneralSceneDescription", "the file is an MVR show, no photometric file"},
        {"[Content_Types].xml", "", "the file is an office document, no photometric file"},
    };
    for (const ZipEntry& entry : archive.entries()) {
        const auto* const kind = std::ranges::find(kKinds, file_name(entry.name), &Kind::file);
        if (kind == std::end(kKinds)) continue;
        const auto text = archive.read(entry.name);
        if (text && std::string_view(*text).substr(0, 4096).find(kind->content) != std::string_view::npos)
            return Error{"not_photometry", shown_text(entry.name, 200), {}, kind->message};
    }
    return std::nullopt;
}

}  // namespace

Result<Photometry> read_zip(std::string_view bytes, const Choice& choice) {
    ZipLimits limits;
    limits.archive_bytes = limits.entry_bytes = kMaxFileBytes;
    limits.total_bytes = 4 * kMaxFileBytes;
    const auto archive = open_zip(std::string(bytes), limits);
    if (!archive) return archive.error();
    if (archive->find(kProduct)) return read_gldf(bytes, choice);
    if (auto other = other_archive(*archive)) return *other;
    const std::vector<std::string> names = photometric_files(*archive);
    if (names.empty())
        return Error{"no_product",
                     kProduct,
                     {},
                     "the archive has no photometric file (.ies, .ldt, .xml), and no product.xml as GLDF has"};
    const std::string* chosen = &names.front();
    if (!choice.variant.empty()) {
        const auto wanted = std::ranges::find_if(names, [&](const std::string& name) {
            return name == choice.variant || file_name(name) == choice.variant;
        });
        if (wanted == names.end())
            return Error{"no_such_variant", "archive", choice.variant,
                         "the archive has no such photometric file; it has " + listed(names)};
        chosen = &*wanted;
    } else if (names.size() > 1) {
        return Error{"several_files", "archive", std::to_string(names.size()),
                     "the archive has several photometric files, and one must be chosen of " + listed(names)};
    }
    const auto text = archive->read(*chosen);
    if (!text) return text.error();
    const std::string shown = shown_text(*chosen, 200);
    if (looks_like_zip(*text))
        return Error{"unknown_format", shown, {}, "an archive within the archive is no photometric file"};
    auto read = read_photometry(*text, {{}, choice.emitter});
    if (!read) {
        Error error = read.error();
        error.where = shown + " " + error.where;
        return error;
    }
    read->diagnostics.insert(read->diagnostics.begin(),
                             {"from_archive", "note", 0, 0, "the photometric file is " + shown + " of an archive"});
    return read;
}

}  // namespace gonio::ies::detail
