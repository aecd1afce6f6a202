#include "ies/photometry_file.h"

#include <algorithm>
#include <array>

#include "ies/core/zip.h"
#include "ies/eulumdat.h"
#include "ies/foreign.h"
#include "ies/lm63_header.h"
#include "ies/photometry_zip.h"
#include "ies/text_encoding.h"
#include "ies/tm33.h"
#include "ies/xml_text.h"

namespace gonio::ies {

namespace {

Result<Photometry> read_by_content(std::string_view bytes, const Choice& choice) {
    if (bytes.size() > kMaxFileBytes) return read_lm63(bytes);  // refuses it
    if (looks_like_zip(bytes)) return detail::read_zip(bytes, choice);
    if (detail::looks_like_xml(bytes)) return read_tm33(bytes, choice);
    const bool variant = !choice.variant.empty();
    if (variant || !choice.emitter.empty())
        return Error{variant ? "no_such_variant" : "no_such_emitter", "line 1 column 1",
                     variant ? choice.variant : choice.emitter, "a file of this format has one luminaire"};
    const std::string decoded = detail::decode_utf16(bytes);
    const std::string_view text = decoded.empty() ? detail::without_mark(bytes) : std::string_view(decoded);
    const bool eulumdat = !detail::starts_with_lm63_version(text) && looks_like_eulumdat(text);
    return eulumdat ? read_eulumdat(bytes) : read_lm63(bytes);
}

// Whether the refusal says no more than that the file is not of the format that was tried for want of a better one.
bool is_vague(const Error& error) {
    constexpr std::array kCodes = {"no_tilt", "unknown_root",    "xml_doctype",
                                   "bad_xml", "no_such_variant", "no_such_emitter"};
    return std::ranges::find(kCodes, error.code) != kCodes.end();
}

}  // namespace

Result<Photometry> read_photometry(std::string_view bytes, const Choice& choice) {
    auto read = read_by_content(bytes, choice);
    if (read || looks_like_zip(bytes) || !is_vague(read.error())) return read;
    if (auto error = detail::foreign_file(bytes)) return *error;
    return read;
}

}  // namespace gonio::ies
