// The same as send.h and fetch.h through DICOMweb (PS3.18): STOW-RS, QIDO-RS and WADO-RS of a server's root address.
//
// Call them while the process has one thread: names are looked up in another, and what came is read in a process of its
// own. What errors say of the server holds no identity.
#pragma once
#include <vector>

#include "osteo/core/base/context.h"
#include "osteo/core/base/files.h"
#include "osteo/hospital/pacs/fetch.h"
#include "osteo/hospital/pacs/send.h"
#include "osteo/hospital/pacs/web.h"

namespace osteo::inline hospital {

/// Error(usage) for an address that is none, has a user in it, or is not https:// and leads away from this machine:
/// what is asked and answered identifies people.
void check_dicomweb(const WebServer& server);

/// Objects by STOW-RS, as they are, up to 32 MB or 100 of a study in a request. An object is accepted when the answer
/// names it among those that were stored; what it says of those it rejects is told; where it says nothing of one, that
/// is a problem too. With `check` the server is asked by QIDO-RS which of them it has. A connection that is lost leaves
/// the rest unsent, which is told of each. Errors: failed when nothing could be sent at all (no connection, login
/// rejected, redirect); cancelled.
[[nodiscard]] SendReport send_objects(const WebServer& server, const std::vector<DicomObject>& objects,
                                      bool check = true, const Context& context = {});

/// Series that match, by study and number, by QIDO-RS; at most 10,000 (Error usage: ask for less). The address holds
/// what is asked for, and servers keep lists of addresses. Errors: usage as above; failed, also when the server answers
/// with what was not asked for.
[[nodiscard]] std::vector<RemoteSeries> find_series(const WebServer& server, const SeriesKeys& keys,
                                                    const Context& context = {});

/// The objects of a series into `folder` (which must exist and be empty) by WADO-RS, bit for bit in the form in which
/// the server has them, named by their order. Each must be a whole DICOM file of this series that QIDO-RS lists, and
/// each of those must come, once. Errors: failed otherwise; resources past a limit; cannot_write; cancelled. Nothing of
/// what was written is taken away: the folder is the caller's.
[[nodiscard]] FetchReport fetch_series(const WebServer& server, const RemoteSeries& series, const fs::path& folder,
                                       const FetchLimits& limits = {}, const Context& context = {});

}  // namespace osteo::inline hospital
