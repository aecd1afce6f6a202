// GLDF (Global Lighting Data Format, 1.0.0-rc.3): a zip archive with product.xml -> the photometry of one of its
// lights.
#pragma once

#include <string_view>

#include "ies/choice.h"
#include "ies/core/result.h"
#include "ies/photometry.h"

namespace gonio::ies {

// bytes: the archive, at most 64 MiB and 10,000 entries. No entry has more than 64 MiB, all together 256 MiB.
//
// choice.variant: a variant's id or name. choice.emitter: an emitter's id, or the name that it has in the model. ID/2
// is the second of an emitter's interchangeable light emitters. Empty: the first variant that has an emitter, and its
// first emitter with light. Of that it is the first light emitter that is not for emergencies only.
//
// Older drafts have references to emitters in the Variant itself. Where a variant names none and the product has only
// one with light, it is that one's: note `emitter_assumed`.
//
// The chain Variant → Geometry → Emitter → Photometry → File leads to a file of LM-63, EULUMDAT or TM-33. Then:
// - Flux. The rated luminous flux is that of a fixed emitter, or of the light sources of a changeable emitter's
// equipment.
//   Of several channels it is the sum of those with the first one's photometry.
// - Lamps of relative photometry get the rated flux, and the light output ratio stays. Absolute photometry is scaled to
//   the rated flux. The note `flux_scaled` tells.
// - A rotation about the vertical alone turns the web. Every other is left out: warning `rotation_not_applied`.
// - The opening is that of the L3D model's luminous object, else of the simple geometry (millimetres). Where there is
// none
//   it is the photometric file's.
// - Files of type url are never fetched: file_not_fetched, where the photometry is one.
//
// Errors of its own: no_product, unknown_root, no_variant, no_such_variant, no_emitter, no_such_emitter, no_light.
// Errors of references: missing_reference, missing_file, file_not_fetched, unknown_format, candela_too_large.
// Others are those of archives (ies/core/zip.h), of XML, and of the photometric file, whose name stands in the place.
// Any thread.
Result<Photometry> read_gldf(std::string_view bytes, const Choice& choice = {});

}  // namespace gonio::ies
