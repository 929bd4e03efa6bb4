// Series of an Orthanc server, copied into a folder as its list of changes says that they are whole. The folder can
// then be watched.
//   FOLDER/.orthanc.json     the server and the number of the last change that was dealt with
//   FOLDER/series-HASH/      a series: appears whole; late objects come to it
//   FOLDER/.series-HASH/     one that is being fetched
// Source: the REST interface of the Orthanc Book ("Tracking changes").
#pragma once
#include "osteo/core/base/context.h"
#include "osteo/core/base/files.h"
#include "osteo/hospital/pacs/web.h"

namespace osteo::inline hospital {

struct OrthancServer : WebServer {
  OrthancServer() { flag = "--orthanc"; }
  double object_gb = 2;     ///< a larger object is not taken
  double keep_free_mb = 0;  ///< on the folder's disk; with less, nothing is fetched
};

/// Error(usage) for an address that is none, has a user in it, or would send the login over a network in the clear.
void check_orthanc(const OrthancServer& server);

/// Makes the folder when it is not there (mode 700). Error(cannot_write) where it holds something else, or the copy of
/// another server.
void open_orthanc_folder(const fs::path& folder, const OrthancServer& server);

/// Deals with all changes since the last time, in their order: of each series that has become stable (again) and is CT
/// or MR, the objects that are not there yet are fetched, checked (a DICOM object of the length that the server says)
/// and synced; then the number is kept. So it can be ended at any moment, and called again. A series whose objects are
/// wrong three times is left out. What to tell is given to `context` as warnings, without identities. Begins threads:
/// call it in a process of its own. Errors: failed (the server is away, stalls, rejects, or says what cannot be),
/// resources (disk), cannot_write, cancelled.
void follow_orthanc(const fs::path& folder, const OrthancServer& server, const Context& context);

}  // namespace osteo::inline hospital
