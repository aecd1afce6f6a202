#include "server/http/tls_context.h"

#include "server/base/bounded_file.h"

namespace gonio {
namespace {

constexpr std::size_t kMaxPemBytes = 1 << 20;  // a long chain has some 20 KiB

Error unusable(const std::string& file, const std::string& why) {
    return {"bad_certificate", file, "", "The file cannot be used for TLS: " + why + "."};
}

Result<std::string> read_pem(const std::string& file) {
    auto text = read_bounded_file(file, kMaxPemBytes);
    if (!text) return unusable(file, "it " + text.error().message);
    if (text->size() > kMaxPemBytes) return unusable(file, "it has more than 1 MiB");
    return text;
}

}  // namespace

Result<std::shared_ptr<TlsContext>> load_tls(const std::string& certificate_file, const std::string& key_file) {
    auto tls = std::make_shared<TlsContext>();
    asio::ssl::context& context = tls->context;
    error_code error;
    context.set_options(asio::ssl::context::default_workarounds | asio::ssl::context::no_compression |
                            SSL_OP_NO_RENEGOTIATION | SSL_OP_CIPHER_SERVER_PREFERENCE,
                        error);
    if (error) return unusable("", error.message());
    SSL_CTX_set_min_proto_version(context.native_handle(), TLS1_2_VERSION);
    // Of TLS 1.2 what RFC 9325, 4.2, recommends: a key of each connection's own, and authenticated encryption.
    if (SSL_CTX_set_cipher_list(context.native_handle(), "ECDHE+AESGCM:ECDHE+CHACHA20") != 1)
        return Error{"bad_certificate", "", "", "OpenSSL has none of the ciphers of TLS 1.2 that are offered."};
    const auto certificate = read_pem(certificate_file);
    if (!certificate) return certificate.error();
    context.use_certificate_chain(asio::buffer(*certificate), error);
    if (error) return unusable(certificate_file, error.message());
    // An encrypted key would ask a terminal for its password.
    context.set_password_callback([](std::size_t, asio::ssl::context::password_purpose) { return std::string(); },
                                  error);
    const auto key = read_pem(key_file);
    if (!key) return key.error();
    context.use_private_key(asio::buffer(*key), asio::ssl::context::pem, error);
    if (error) return unusable(key_file, error.message());
    if (SSL_CTX_check_private_key(context.native_handle()) != 1)
        return Error{"bad_certificate", key_file, "", "The key is not the one of the certificate."};
    return tls;
}

}  // namespace gonio
