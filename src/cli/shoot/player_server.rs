//! The pattern player's server: the page asks it which picture to show, and says which one the display shows.
//!
//! It listens on this computer only, and answers only pages that it served itself: other names of this computer, by which a
//! page of the web could reach it, are refused.

use std::collections::HashSet;
use std::io;
use std::net::{Ipv4Addr, SocketAddr};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, SystemTime};

use axum::Router;
use axum::extract::{Path as UrlPath, Request, State};
use axum::http::{HeaderValue, StatusCode, header};
use axum::middleware::{self, Next};
use axum::response::{Html, IntoResponse, Json, Response};
use axum::routing::{get, post};
use serde::{Deserialize, Serialize};
use tokio::net::TcpListener;
use tokio::runtime::Runtime;
use tokio::sync::watch;

/// The page asks again after this long at the latest.
const POLL_LIMIT: Duration = Duration::from_secs(15);
/// What the page may load: its own pictures and answers.
const CONTENT_SECURITY_POLICY: &str = "default-src 'none'; img-src 'self'; connect-src 'self'; \
                                       style-src 'unsafe-inline'; script-src 'unsafe-inline'";

/// What the page shows.
#[derive(Clone, Debug, Default, Serialize)]
pub struct PageState {
    /// Differs between runs of this program, whose other numbers begin anew.
    pub run: u64,
    /// Of which the page has the pictures: another one needs another page.
    pub sequence: String,
    /// Rises with each change.
    pub version: u64,
    /// The picture to show; none before the first.
    pub show: Option<ShownPicture>,
    /// The present step, for the operator.
    pub message: String,
    /// The last photograph's histogram of each channel, from black to white.
    pub histogram: Vec<Vec<u32>>,
    /// What the operator is asked; the answer is to photograph again, or to go on.
    pub question: Option<String>,
    /// The session is complete.
    pub finished: bool,
}

/// A picture of the sequence, shown for one photograph.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ShownPicture {
    /// Its index.
    pub picture: usize,
    /// Number of the photograph: a picture that is photographed again is shown again.
    pub photograph: u64,
}

/// What the page says.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PlayerState {
    /// The picture that the display shows, pixel by pixel.
    pub shown: Option<ShownPicture>,
    /// The page that shows it: there may be others.
    page: String,
    /// How often a picture has been taken away, by the end of full screen for instance.
    pub withdrawals: u64,
    /// Answers so far, and the last one: whether to photograph again.
    pub answer: (u64, bool),
}

/// Body of `POST /shown`.
#[derive(Deserialize)]
struct Shown {
    page: String,
    shown: Option<ShownPicture>,
}

/// Body of `POST /answer`.
#[derive(Deserialize)]
struct Answer {
    again: bool,
}

struct Shared {
    folder: PathBuf,
    /// Paths of pictures in `folder`.
    pictures: HashSet<String>,
    page: String,
    /// What `Host` may say.
    hosts: [String; 2],
    page_state: watch::Sender<PageState>,
    player_state: watch::Sender<PlayerState>,
    /// The last version that a page has fetched.
    fetched: AtomicU64,
}

/// A server that runs until it is dropped.
pub struct PlayerServer {
    /// Address of the page.
    pub url: String,
    shared: Arc<Shared>,
    // Last, so that the server ends after everything else.
    _runtime: Runtime,
}

impl PlayerServer {
    /// Serves `page` and the `pictures` in `folder` on `port` of this computer; on any free port if it is 0.
    ///
    /// # Errors
    /// If the port is taken.
    pub fn start(
        page: String,
        folder: &Path,
        pictures: HashSet<String>,
        sequence: String,
        port: u16,
    ) -> io::Result<Self> {
        let runtime = tokio::runtime::Builder::new_multi_thread()
            .worker_threads(1)
            .enable_all()
            .build()?;
        let address = SocketAddr::from((Ipv4Addr::LOCALHOST, port));
        let listener = runtime.block_on(TcpListener::bind(address))?;
        let port = listener.local_addr()?.port();
        let shared = Arc::new(Shared {
            folder: folder.to_owned(),
            pictures,
            page,
            hosts: [format!("127.0.0.1:{port}"), format!("localhost:{port}")],
            page_state: watch::Sender::new(PageState {
                run: run_number(),
                sequence,
                version: 1,
                ..PageState::default()
            }),
            fetched: AtomicU64::new(0),
            player_state: watch::Sender::new(PlayerState::default()),
        });
        let routes = Router::new()
            .route("/", get(page_of))
            .route("/display/{name}", get(picture))
            .route("/state/{version}", get(state))
            .route("/shown", post(shown))
            .route("/answer", post(answer))
            .layer(middleware::from_fn_with_state(
                Arc::clone(&shared),
                of_this_server,
            ))
            .with_state(Arc::clone(&shared));
        runtime.spawn(async move { axum::serve(listener, routes).await });
        Ok(Self {
            url: format!("http://127.0.0.1:{port}/"),
            shared,
            _runtime: runtime,
        })
    }

    /// Changes what the page shows.
    pub fn update(&self, change: impl FnOnce(&mut PageState)) {
        self.shared.page_state.send_modify(|state| {
            change(state);
            state.version += 1;
        });
    }

    /// What the page has said last.
    pub fn player(&self) -> PlayerState {
        self.shared.player_state.borrow().clone()
    }

    /// Whether a page waits for changes.
    pub fn has_page(&self) -> bool {
        self.shared.page_state.receiver_count() > 0
    }

    /// Whether a page has learned of the last change.
    pub fn is_fetched(&self) -> bool {
        let version = self.shared.page_state.borrow().version;
        self.shared.fetched.load(Ordering::Relaxed) >= version
    }
}

/// A number that differs between runs.
fn run_number() -> u64 {
    let now = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH);
    // JavaScript's numbers are exact up to 2^53.
    now.map_or(0, |time| time.as_millis() as u64)
}

async fn of_this_server(
    State(shared): State<Arc<Shared>>,
    request: Request,
    next: Next,
) -> Response {
    let host = request.headers().get(header::HOST);
    let host = host.and_then(|host| host.to_str().ok());
    if host.is_none_or(|host| !shared.hosts.iter().any(|own| own == host)) {
        return StatusCode::FORBIDDEN.into_response();
    }
    let mut response = next.run(request).await;
    let headers = response.headers_mut();
    headers.insert(
        header::CONTENT_SECURITY_POLICY,
        HeaderValue::from_static(CONTENT_SECURITY_POLICY),
    );
    headers.insert(header::CACHE_CONTROL, HeaderValue::from_static("no-cache"));
    response
}

async fn page_of(State(shared): State<Arc<Shared>>) -> Html<String> {
    Html(shared.page.clone())
}

async fn picture(State(shared): State<Arc<Shared>>, UrlPath(name): UrlPath<String>) -> Response {
    let name = format!("display/{name}");
    if !shared.pictures.contains(&name) {
        return StatusCode::NOT_FOUND.into_response();
    }
    let path = shared.folder.join(name);
    match tokio::task::spawn_blocking(move || std::fs::read(path)).await {
        Ok(Ok(bytes)) => ([(header::CONTENT_TYPE, "image/png")], bytes).into_response(),
        _ => StatusCode::NOT_FOUND.into_response(),
    }
}

/// Answers when the state is no longer that of `version`, or after a while.
async fn state(
    State(shared): State<Arc<Shared>>,
    UrlPath(version): UrlPath<u64>,
) -> Json<PageState> {
    let mut changes = shared.page_state.subscribe();
    let changed = changes.wait_for(|state| state.version != version);
    // After the limit, the page learns that nothing has changed.
    let _ = tokio::time::timeout(POLL_LIMIT, changed).await.is_ok();
    let state = shared.page_state.borrow().clone();
    shared.fetched.fetch_max(state.version, Ordering::Relaxed);
    Json(state)
}

async fn shown(State(shared): State<Arc<Shared>>, Json(body): Json<Shown>) -> StatusCode {
    shared.player_state.send_modify(|state| match body.shown {
        Some(_) => {
            state.shown = body.shown;
            state.page = body.page;
        }
        None if state.page == body.page => {
            state.shown = None;
            state.withdrawals += 1;
        }
        None => {}
    });
    StatusCode::NO_CONTENT
}

async fn answer(State(shared): State<Arc<Shared>>, Json(body): Json<Answer>) -> StatusCode {
    shared
        .player_state
        .send_modify(|state| state.answer = (state.answer.0 + 1, body.again));
    StatusCode::NO_CONTENT
}
