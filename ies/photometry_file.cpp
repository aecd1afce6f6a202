#include "ies/photometry_file.h"

#include "ies/core/zip.h"
#include "ies/eulumdat.h"
#include "ies/gldf.h"
#include "ies/lm63_header.h"
#include "ies/text_encoding.h"
#include "ies/tm33.h"
#include "ies/xml_text.h"

namespace gonio::ies {

Result<Photometry> read_photometry(std::string_view bytes, const Choice& choice) {
    if (bytes.size() > kMaxFileBytes) return read_lm63(bytes);  // refuses it
    if (looks_like_zip(bytes)) return read_gldf(bytes, choice);
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

}  // namespace gonio::ies
