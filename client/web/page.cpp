#include "client/web/page.h"

#include <string>
#include <vector>

#include "protocol/schema/palette.h"
#include "protocol/schema/property.h"

namespace gonio {

std::span<const EmbeddedFile> page_files() {
    static const std::string properties = properties_module(), palettes = palettes_module();
    static const std::vector<EmbeddedFile> files = [] {
        const std::span<const EmbeddedFile> sources = page_sources();
        std::vector<EmbeddedFile> all(sources.begin(), sources.end());
        all.push_back({"properties.js", properties});
        all.push_back({"palettes.js", palettes});
        return all;
    }();
    return files;
}

}  // namespace gonio
