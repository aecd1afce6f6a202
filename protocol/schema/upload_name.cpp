#include "protocol/schema/upload_name.h"

#include "ies/core/text.h"
#include "protocol/text/text_bytes.h"

namespace gonio {

bool is_upload_name(std::string_view name) {
    if (name.empty() || name.size() > kMaxUploadName || name.front() == '.' || name.front() == ' ') return false;
    for (std::size_t at = 0; at < name.size();) {
        const std::size_t length = utf8_length(name, at);
        if (length == 0 || unseen_length(name, at) > 0) return false;
        if (name[at] == '/' || name[at] == '\\' || name[at] == '"') return false;
        at += length;
    }
    const std::string ending = ending_of(name);
    return ending == ".glb" || ending == ".gltf" || ending == ".mvr" || ending == ".json" || is_photometry_name(name);
}

}  // namespace gonio
