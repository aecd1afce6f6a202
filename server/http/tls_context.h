// What TlsContext is, for the .cpp files that know OpenSSL.
#pragma once

#include "protocol/net/beast.h"

#include <boost/asio/ssl/context.hpp>

#include "server/http/tls.h"

namespace gonio {

struct TlsContext {
    asio::ssl::context context{asio::ssl::context::tls_server};
};

}  // namespace gonio
