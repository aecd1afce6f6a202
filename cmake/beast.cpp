// The whole of Boost.Asio and Boost.Beast that is not a template, once for client/connection and server/http.
#include <boost/asio/impl/src.hpp>
#include <boost/asio/ssl/impl/src.hpp>
#include <boost/beast/src.hpp>
