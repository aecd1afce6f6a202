#include "ies/photometry_file.h"

#include "ies/eulumdat.h"
#include "ies/lm63_header.h"
#include "ies/text_encoding.h"

namespace gonio::ies {

Result<Photometry> read_photometry(std::string_view bytes) {
    if (bytes.size() > kMaxFileBytes) return read_lm63(bytes);  // refuses it
    const std::string decoded = detail::decode_utf16(bytes);
    const std::string_view text = decoded.empty() ? detail::without_mark(bytes) : std::string_view(decoded);
    const bool eulumdat = !detail::starts_with_lm63_version(text) && looks_like_eulumdat(text);
    return eulumdat ? read_eulumdat(bytes) : read_lm63(bytes);
}

}  // namespace gonio::ies
