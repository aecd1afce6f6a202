// Certificate and key of the HTTPS port. OpenSSL and Boost stay in the .cpp files.
#pragma once

#include <memory>
#include <string>

#include "ies/core/result.h"

namespace gonio {

// One certificate chain with its key, as connections that begin now use it. Immutable; connections that stand keep
// theirs. Defined in tls_context.h.
struct TlsContext;

// certificate_file: PEM, the server's own certificate first, then those up to the root; key_file: PEM, unencrypted.
// TLS 1.2 and later only. Errors: "bad_certificate" with the file as place.
Result<std::shared_ptr<TlsContext>> load_tls(const std::string& certificate_file, const std::string& key_file);

}  // namespace gonio
